// A packet of the camera's rays, aimed around its middle ray. Included once for each instruction
// set.

#if defined(SHERD_CAMERA_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SHERD_CAMERA_RAYS_INL_H
#undef SHERD_CAMERA_RAYS_INL_H
#else
#define SHERD_CAMERA_RAYS_INL_H
#endif

#include <hwy/highway.h>

#include <cmath>

#include "metaball/camera.h"
#include "metaball/packet_window-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

// One ray a pixel, the pixels of a block as near to a square as the lanes allow. The middle ray is
// found in doubles, the others as differences from it, which so keep their own accuracy.
template <class Real>
class CameraRays {
  using L = Lanes<Real>;

 public:
  SHERD_PACKET_INLINE CameraRays() {
    for (int i = 0; i < L::Count(); ++i) {
      lane_x_[i] = static_cast<Real>(i % width());
      lane_y_[i] = static_cast<Real>(i / width());
    }
  }

  // Of the block, pixels.
  static SHERD_PACKET_INLINE int width() { return L::Count() >= 8 ? 4 : L::Count() >= 4 ? 2 : 1; }
  static SHERD_PACKET_INLINE int height() { return L::Count() / width(); }
  SHERD_PACKET_INLINE int PixelX(int lane) const { return x0_ + lane % width(); }
  SHERD_PACKET_INLINE int PixelY(int lane) const { return y0_ + lane / width(); }

  // Aims at the block whose first pixel is (x0, y0). With c the middle ray's direction before it is
  // made a unit vector, e the step on the picture plane, u = c + e and m = |u|^2 - |c|^2,
  //   u / |u| - c / |c| = e / |u| - c m / (|u| |c| (|u| + |c|)).
  SHERD_PACKET_INLINE void Aim(const Camera& camera, int x0, int y0) {
    x0_ = x0;
    y0_ = y0;
    perspective_ = camera.projection == Projection::kPerspective;
    const double x = x0 + 0.5 * width(), y = y0 + 0.5 * height();
    axis_ = RayThrough(camera, x, y);
    const L step_x = (L::Load(lane_x_) - L(0.5 * (width() - 1))) * L(1.0 / camera.fx);
    const L step_y = (L::Load(lane_y_) - L(0.5 * (height() - 1))) * L(1.0 / camera.fy);
    L ex = step_x * L(camera.right.x) + step_y * L(camera.down.x);
    L ey = step_x * L(camera.right.y) + step_y * L(camera.down.y);
    L ez = step_x * L(camera.right.z) + step_y * L(camera.down.z);
    const L ax = L(axis_.direction.x), ay = L(axis_.direction.y), az = L(axis_.direction.z);
    if (perspective_) {
      const double length = std::sqrt(1.0 + Square((x - camera.cx) / camera.fx) +
                                      Square((y - camera.cy) / camera.fy));
      const L c = L(length);
      const L cx = ax * c, cy = ay * c, cz = az * c;
      const L m = L(2) * (cx * ex + cy * ey + cz * ez) + (ex * ex + ey * ey + ez * ez);
      const L u = SquareRoot(c * c + m);
      const L along_e = L(1) / u, along_c = m / (u * c * (u + c));
      ex = ex * along_e - cx * along_c;
      ey = ey * along_e - cy * along_c;
      ez = ez * along_e - cz * along_c;
      (ax + ex).Store(rays_.dx);
      (ay + ey).Store(rays_.dy);
      (az + ez).Store(rays_.dz);
    } else {
      ax.Store(rays_.dx);
      ay.Store(rays_.dy);
      az.Store(rays_.dz);
    }
    ex.Store(sx_);
    ey.Store(sy_);
    ez.Store(sz_);
    widest_ = std::sqrt(static_cast<double>(LargestOf(ex * ex + ey * ey + ez * ez))) * 1.0001;
  }

  // Lanes whose pixels the picture has.
  SHERD_PACKET_INLINE LaneMask<Real> InPicture(int picture_width, int picture_height) const {
    return Both(L::Load(lane_x_) < L(picture_width - x0_),
                L::Load(lane_y_) < L(picture_height - y0_));
  }

  // The middle ray's point at depth t.
  SHERD_PACKET_INLINE Vec3d PointAt(double t) const { return axis_.origin + axis_.direction * t; }
  // Counts the rays from depth t on and in coordinates relative to `anchor`, a point near.
  SHERD_PACKET_INLINE void CountFrom(const Vec3d& anchor, double t) {
    const Vec3d off = PointAt(t) - anchor;
    const L reach = L(perspective_ ? t : 1.0);
    (L::Load(sx_) * reach + L(off.x)).Store(rays_.ox);
    (L::Load(sy_) * reach + L(off.y)).Store(rays_.oy);
    (L::Load(sz_) * reach + L(off.z)).Store(rays_.oz);
  }

  SHERD_PACKET_INLINE const PacketRays<Real>& rays() const { return rays_; }
  SHERD_PACKET_INLINE const RayD& axis() const { return axis_; }
  // No ray is farther from the middle ray than this at a distance of 1 (perspective; at another
  // distance in proportion) or anywhere.
  SHERD_PACKET_INLINE double widest() const { return widest_; }

 private:
  static SHERD_PACKET_INLINE double Square(double v) { return v * v; }

  int x0_ = 0, y0_ = 0;
  bool perspective_ = true;
  RayD axis_;
  double widest_ = 0.0;
  HWY_ALIGN Real lane_x_[kMaxLanes], lane_y_[kMaxLanes];  // pixels from (x0, y0)
  PacketRays<Real> rays_;
  // Differences from the middle ray: of direction, or of origin where the view is orthographic.
  HWY_ALIGN Real sx_[kMaxLanes], sy_[kMaxLanes], sz_[kMaxLanes];
};

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#endif  // per target
