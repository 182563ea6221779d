// The picture of one pane: shows what was rendered and turns mouse and keys into camera moves.
#pragma once

#include <QElapsedTimer>
#include <QImage>
#include <QPoint>
#include <QWidget>
#include <memory>
#include <optional>

#include "app/desktop/camera_controller.h"
#include "app/desktop/render_queue.h"

namespace sherd {

// A surface point under the cursor.
struct SurfaceHit {
  Vec3d point{};        // world
  int id = -1;          // the metaball, in its level
  double distance = 0;  // along the ray, world units
};

class ViewCanvas : public QWidget {
  Q_OBJECT

 public:
  explicit ViewCanvas(CameraController* controller, QWidget* parent = nullptr);

  // The picture's size in device pixels.
  QSize pixelSize() const;
  void setView(std::shared_ptr<const RenderedView> view);
  const std::shared_ptr<const RenderedView>& view() const { return view_; }
  // A line in the middle of the canvas; empty for none.
  void setMessage(const QString& message);
  const QString& message() const { return message_; }
  // A thin line at the lower edge while a picture is being refined; negative for none.
  void setProgress(double fraction);
  void setBackground(const QColor& color);
  QColor background() const { return background_; }
  void setMetresPerUnit(std::optional<double> metres_per_unit);
  void setOverlaysVisible(bool visible);
  // Marks a world point that is looked at in another pane.
  void setMark(const std::optional<Vec3d>& point);
  // A photograph to lay over the view as long as the camera stands where it was taken.
  void setPhotograph(const QImage& photo, const QString& name);
  void setPhotographOpacity(double opacity);
  // While picking, a click reports a surface point and moves nothing.
  void setPicking(bool picking);

  // The surface under a position in widget coordinates, from the last picture.
  std::optional<SurfaceHit> hitAt(const QPointF& position) const;

  QSize minimumSizeHint() const override { return {160, 120}; }
  QSize sizeHint() const override { return {480, 360}; }

 Q_SIGNALS:
  void cameraMoved();
  void resized();
  void activated();
  // Position under the cursor; without value when the cursor left or is over the background.
  void hovered(std::optional<sherd::SurfaceHit> hit);
  void pointPicked(const sherd::SurfaceHit& hit);

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void focusInEvent(QFocusEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  enum class Drag { kNone, kOrbit, kPan, kZoom };

  void paintPhotograph(QPainter* painter, const Camera& camera);
  // World point for a move that starts at `position`: the surface there, else the target's depth.
  Vec3d anchorAt(const QPointF& position) const;
  QPointF toPixels(const QPointF& position) const { return position * devicePixelRatioF(); }

  CameraController* controller_;
  std::shared_ptr<const RenderedView> view_;
  QString message_;
  double progress_ = -1;
  QColor background_;
  std::optional<double> metres_per_unit_;
  bool overlays_visible_ = true;
  std::optional<Vec3d> mark_;
  QImage photo_;
  QString photo_name_;
  double photo_opacity_ = 0;
  bool picking_ = false;

  Drag drag_ = Drag::kNone;
  QPointF last_position_;
  Vec3d anchor_{};
  // A turn of the wheel is many events: they all refer to the point under the first one.
  QElapsedTimer since_wheel_;
  QPointF wheel_position_;
  Vec3d wheel_anchor_{};
};

}  // namespace sherd
