// A frame's planes in the machine's memory, under the names that Frame gives them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/kernels/resolve.h"
#include "metaball/appearance/gather.h"
#include "metaball/cloud.h"
#include "metaball/frame.h"
#include "metaball/vec.h"

namespace sherd {

// A part of a picture, in pixels.
struct Region {
  int x0 = 0, y0 = 0, width = 0, height = 0;

  std::uint64_t pixels() const { return static_cast<std::uint64_t>(width) * height; }
  // With a border of that many pixels on every side.
  Region Grown(int border) const {
    return {x0 - border, y0 - border, width + 2 * border, height + 2 * border};
  }
};

template <class Machine>
class FrameBuffers {
 public:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;
  struct ChannelBuffer {
    int components = 1;
    Buffer<float> values;
  };
  struct UvBuffer {
    Buffer<SurfaceUv> values;
  };

  Buffer<Pixel> color;
  Buffer<float> depth;
  Buffer<Vec3f> normal;
  Buffer<std::int32_t> id;
  Buffer<Vec3f> light;
  Buffer<float> weight, intensity;
  Buffer<Vec3f> influence;
  std::vector<ChannelBuffer> channels;
  std::vector<UvBuffer> uv;

  // Room for n pixels of the planes; those not wanted have none.
  void Reserve(const Cloud& cloud, const Planes& planes, std::size_t n, Machine* machine) {
    const auto reserve = [&](auto* buffer, bool wanted, std::size_t components = 1) {
      machine->Resize(buffer, wanted ? n * components : 0, "picture");
    };
    reserve(&color, true);
    reserve(&depth, planes.depth);
    reserve(&normal, planes.normal);
    reserve(&id, planes.id);
    reserve(&light, planes.light);
    reserve(&weight, planes.weight);
    reserve(&intensity, planes.intensity);
    reserve(&influence, planes.influence);
    while (channels.size() > planes.channels.size()) {
      machine->Release(&channels.back().values);
      channels.pop_back();
    }
    channels.resize(planes.channels.size());
    for (std::size_t k = 0; k < channels.size(); ++k) {
      channels[k].components = ChannelNamed(cloud, planes.channels[k]).components();
      reserve(&channels[k].values, true, static_cast<std::size_t>(channels[k].components));
    }
    while (uv.size() > planes.uv.size()) {
      machine->Release(&uv.back().values);
      uv.pop_back();
    }
    uv.resize(planes.uv.size());
    for (UvBuffer& plane : uv) reserve(&plane.values, true);
  }

  void Release(Machine* machine) {
    machine->Release(&color);
    ForEachPlane(*this, *this, [&](auto& buffer, auto&, int) { machine->Release(&buffer); });
    channels.clear();
    uv.clear();
  }

  // These planes from `fine`, which has samples x samples of each pixel.
  void ResolveFrom(const FrameBuffers& fine, const Region& region, int samples, Machine* machine) {
    machine->ForEach("ResolveColor", region.pixels(),
                     kernels::ResolveColor{region.width, samples, fine.color.data(), color.data()});
    ForEachPlane(*this, fine, [&](auto& plane, const auto& from, int components) {
      if (plane.size() == 0) return;
      machine->ForEach(
          "TakeMiddle", region.pixels() * static_cast<std::uint64_t>(components),
          kernels::TakeMiddle{region.width, samples, components, from.data(), plane.data()});
    });
  }

  // Copies to the frame's planes what lies in `region`. The buffers hold `held`, which reaches
  // beyond it; their colours may be somewhere else.
  void CopyOut(const Region& held, const Region& region, Frame* frame, Machine* machine) const {
    CopyPlane(color, held, region, 1, &frame->color, frame->width, machine);
    CopyPlanes(held, region, frame, machine);
  }
  // All but the colours.
  void CopyPlanes(const Region& held, const Region& region, Frame* frame, Machine* machine) const {
    ForEachPlane(*frame, *this, [&](auto& plane, const auto& buffer, int components) {
      CopyPlane(buffer, held, region, components, &plane, frame->width, machine);
    });
  }
  template <class T>
  static void CopyPlane(const Buffer<T>& buffer, const Region& held, const Region& region,
                        int components, std::vector<T>* plane, int frame_width, Machine* machine) {
    if (plane->empty()) return;
    const auto at = [components](std::int64_t x, std::int64_t y, int width) {
      return static_cast<std::size_t>((y * width + x) * components);
    };
    machine->DownloadRect(plane->data() + at(region.x0, region.y0, frame_width),
                          static_cast<std::size_t>(frame_width) * components, buffer,
                          at(region.x0 - held.x0, region.y0 - held.y0, held.width),
                          static_cast<std::size_t>(held.width) * components,
                          region.width * components, region.height);
  }

 private:
  // Calls visit(plane of a, plane of b, components) for all but the colours. What b has beyond a's
  // channels and texture coordinates is left out.
  template <class A, class B, class Visit>
  static void ForEachPlane(A& a, B& b, const Visit& visit) {
    visit(a.depth, b.depth, 1);
    visit(a.normal, b.normal, 1);
    visit(a.id, b.id, 1);
    visit(a.light, b.light, 1);
    visit(a.weight, b.weight, 1);
    visit(a.intensity, b.intensity, 1);
    visit(a.influence, b.influence, 1);
    for (std::size_t k = 0; k < a.channels.size(); ++k) {
      visit(a.channels[k].values, b.channels[k].values, a.channels[k].components);
    }
    for (std::size_t k = 0; k < a.uv.size(); ++k) visit(a.uv[k].values, b.uv[k].values, 1);
  }
};

}  // namespace sherd
