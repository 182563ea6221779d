#include "app/desktop/view_canvas.h"

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QWheelEvent>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/desktop/overlay.h"
#include "app/desktop/theme.h"

namespace sherd {
namespace {

// A drag across the shorter side of the view turns the scene half around.
constexpr double kOrbitTurn = std::numbers::pi;
constexpr double kKeyOrbit = 5.0 * std::numbers::pi / 180.0;
constexpr double kKeyPan = 0.05;  // of the shorter side
constexpr double kZoomStep = 0.85;
constexpr int kWheelPauseMs = 400;

}  // namespace

ViewCanvas::ViewCanvas(CameraController* controller, QWidget* parent)
    : QWidget(parent), controller_(controller), background_(theme::kCanvas) {
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setAttribute(Qt::WA_OpaquePaintEvent);
  setCursor(Qt::CrossCursor);
  setObjectName(QStringLiteral("canvas"));
}

QSize ViewCanvas::pixelSize() const {
  const double ratio = devicePixelRatioF();
  return {std::max(1, qRound(width() * ratio)), std::max(1, qRound(height() * ratio))};
}

void ViewCanvas::setView(std::shared_ptr<const RenderedView> view) {
  view_ = std::move(view);
  if (view_ && view_->final) progress_ = -1;
  update();
}

void ViewCanvas::setMessage(const QString& message) {
  if (message == message_) return;
  message_ = message;
  update();
}

void ViewCanvas::setProgress(double fraction) {
  progress_ = fraction;
  update(0, height() - 3, width(), 3);
}

void ViewCanvas::setBackground(const QColor& color) {
  background_ = color;
  update();
}

void ViewCanvas::setMetresPerUnit(std::optional<double> metres_per_unit) {
  metres_per_unit_ = metres_per_unit;
  update();
}

void ViewCanvas::setOverlaysVisible(bool visible) {
  overlays_visible_ = visible;
  update();
}

void ViewCanvas::setMark(const std::optional<Vec3d>& point) {
  if (mark_ == point) return;
  mark_ = point;
  update();
}

void ViewCanvas::setPhotograph(const QImage& photo, const QString& name) {
  photo_ = photo;
  photo_name_ = name;
  update();
}

void ViewCanvas::setPhotographOpacity(double opacity) {
  photo_opacity_ = opacity;
  update();
}

void ViewCanvas::setPicking(bool picking) {
  picking_ = picking;
  setCursor(picking ? Qt::PointingHandCursor : Qt::CrossCursor);
}

std::optional<SurfaceHit> ViewCanvas::hitAt(const QPointF& position) const {
  if (!view_ || view_->depth.empty() || !rect().contains(position.toPoint())) return std::nullopt;
  const Camera& camera = view_->camera;
  const int x =
      std::clamp(static_cast<int>(position.x() / width() * camera.width), 0, camera.width - 1);
  const int y =
      std::clamp(static_cast<int>(position.y() / height() * camera.height), 0, camera.height - 1);
  const std::size_t i = static_cast<std::size_t>(y) * camera.width + x;
  if (i >= view_->depth.size() || !(view_->depth[i] > 0)) return std::nullopt;
  // The depth belongs to the pixel's centre.
  const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
  SurfaceHit hit;
  hit.distance = view_->depth[i];
  hit.point = ray.origin + ray.direction * hit.distance;
  if (i < view_->id.size()) hit.id = view_->id[i];
  return hit;
}

Vec3d ViewCanvas::anchorAt(const QPointF& position) const {
  if (const auto hit = hitAt(position)) return hit->point;
  const QPointF pixel = toPixels(position);
  const QSize size = pixelSize();
  return controller_->PointAtTargetDepth(pixel.x(), pixel.y(), size.width(), size.height());
}

void ViewCanvas::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), background_);
  const QSize size = pixelSize();
  const Camera camera = controller_->MakeCamera(size.width(), size.height());
  if (view_) {
    const double ratio = devicePixelRatioF();
    painter.setRenderHint(QPainter::SmoothPixmapTransform, view_->image.size() != size);
    painter.drawImage(QRectF(0, 0, size.width() / ratio, size.height() / ratio), view_->image);
  }
  paintPhotograph(&painter, camera);
  if (view_ && overlays_visible_) {
    const QRectF area(rect());
    if (metres_per_unit_) {
      const double ratio = devicePixelRatioF();
      const auto bar = MakeScaleBar(camera, controller_->state().distance, *metres_per_unit_,
                                    longestScaleBar(width(), 1.0) * ratio);
      if (bar) {
        drawScaleBar(&painter, area, *bar, 1.0, ratio,
                     camera.projection == Projection::kPerspective);
      }
    }
    drawAxes(&painter, area, camera, 1.0);
  }
  painter.setRenderHint(QPainter::Antialiasing);
  const auto cross = [&](const Vec3d& point, const QColor& color) {
    double x, y;
    if (!camera.Project(point, &x, &y)) return;
    const QPointF p = QPointF(x, y) / devicePixelRatioF();
    for (const auto& [pen_color, pen_width] :
         {std::pair(QColor(0, 0, 0, 160), 3.0), std::pair(color, 1.4)}) {
      painter.setPen(QPen(pen_color, pen_width, Qt::SolidLine, Qt::RoundCap));
      painter.drawLine(p - QPointF(7, 0), p - QPointF(3, 0));
      painter.drawLine(p + QPointF(3, 0), p + QPointF(7, 0));
      painter.drawLine(p - QPointF(0, 7), p - QPointF(0, 3));
      painter.drawLine(p + QPointF(0, 3), p + QPointF(0, 7));
    }
  };
  if (mark_) cross(*mark_, theme::kAccent);
  if (drag_ == Drag::kOrbit) cross(anchor_, QColor(250, 250, 250));
  if (!message_.isEmpty()) {
    QFont font = painter.font();
    font.setPointSizeF(font.pointSizeF() * 1.1);
    painter.setFont(font);
    const QRect text_area = rect().adjusted(24, 24, -24, -24);
    if (view_) {
      const QRect box =
          painter.boundingRect(text_area, Qt::AlignCenter | Qt::TextWordWrap, message_)
              .adjusted(-12, -8, 12, 8);
      painter.setPen(Qt::NoPen);
      painter.setBrush(QColor(20, 21, 23, 200));
      painter.drawRoundedRect(box, 4, 4);
    }
    painter.setPen(background_.lightness() > 128 && !view_ ? QColor(60, 62, 66)
                                                           : QColor(196, 199, 203));
    painter.drawText(text_area, Qt::AlignCenter | Qt::TextWordWrap, message_);
  }
  if (progress_ >= 0) {
    painter.fillRect(QRectF(0, height() - 2, width() * std::min(progress_, 1.0), 2),
                     theme::kAccent);
  }
  if (hasFocus()) {
    painter.setRenderHint(QPainter::Antialiasing, false);
    painter.setBrush(Qt::NoBrush);
    painter.setPen(QPen(theme::kAccent, 1));
    painter.drawRect(rect().adjusted(0, 0, -1, -1));
  }
}

void ViewCanvas::paintPhotograph(QPainter* painter, const Camera& camera) {
  const std::optional<PhotoFilm>& film = controller_->state().film;
  if (!film || photo_name_.isEmpty()) return;
  // Where the photograph's edges lie: from its own pixels to the view's.
  const double ratio = devicePixelRatioF();
  const double sx = camera.fx / film->fx, sy = camera.fy / film->fy;
  const QRectF frame((camera.cx - film->cx * sx) / ratio, (camera.cy - film->cy * sy) / ratio,
                     film->width * sx / ratio, film->height * sy / ratio);
  if (!photo_.isNull() && photo_opacity_ > 0) {
    painter->save();
    painter->setOpacity(photo_opacity_);
    painter->setRenderHint(QPainter::SmoothPixmapTransform);
    painter->drawImage(frame, photo_);
    painter->restore();
  }
  painter->setBrush(Qt::NoBrush);
  painter->setPen(QPen(QColor(255, 255, 255, 90), 1));
  painter->drawRect(frame.adjusted(0.5, 0.5, -0.5, -0.5));
  const QRectF label =
      frame.adjusted(8, 6, -8, -6).intersected(QRectF(rect()).adjusted(8, 6, -8, -6));
  const QString text = painter->fontMetrics().elidedText(photo_name_, Qt::ElideMiddle,
                                                         static_cast<int>(label.width()));
  painter->setPen(QColor(0, 0, 0, 190));
  painter->drawText(label.translated(1, 1), Qt::AlignTop | Qt::AlignLeft, text);
  painter->setPen(QColor(240, 240, 240));
  painter->drawText(label, Qt::AlignTop | Qt::AlignLeft, text);
}

void ViewCanvas::resizeEvent(QResizeEvent*) { Q_EMIT resized(); }

void ViewCanvas::mousePressEvent(QMouseEvent* event) {
  setFocus(Qt::MouseFocusReason);
  Q_EMIT activated();
  last_position_ = event->position();
  if (picking_ && event->button() == Qt::LeftButton) {
    if (const auto hit = hitAt(event->position())) Q_EMIT pointPicked(*hit);
    return;
  }
  if (event->button() == Qt::MiddleButton ||
      (event->button() == Qt::LeftButton && event->modifiers() & Qt::ShiftModifier)) {
    drag_ = Drag::kPan;
    anchor_ = anchorAt(event->position());
  } else if (event->button() == Qt::LeftButton) {
    drag_ = Drag::kOrbit;
    const auto hit = hitAt(event->position());
    anchor_ = hit ? hit->point : controller_->bounds().Center();
  } else if (event->button() == Qt::RightButton) {
    drag_ = Drag::kZoom;
    anchor_ = anchorAt(event->position());
  }
  update();
}

void ViewCanvas::mouseMoveEvent(QMouseEvent* event) {
  const QPointF position = event->position();
  const QPointF delta = position - last_position_;
  last_position_ = position;
  const double shorter = std::min(width(), height());
  switch (drag_) {
    case Drag::kNone:
      Q_EMIT hovered(hitAt(position));
      return;
    case Drag::kOrbit:
      controller_->Orbit(delta.x() / shorter * kOrbitTurn, delta.y() / shorter * kOrbitTurn,
                         anchor_);
      break;
    case Drag::kPan: {
      const QPointF pixels = toPixels(delta);
      const QSize size = pixelSize();
      controller_->Pan(pixels.x(), pixels.y(), anchor_, size.width(), size.height());
      break;
    }
    case Drag::kZoom:
      controller_->ZoomAt(anchor_, std::pow(4.0, delta.y() / shorter));
      break;
  }
  Q_EMIT cameraMoved();
}

void ViewCanvas::mouseReleaseEvent(QMouseEvent* event) {
  if (event->buttons() == Qt::NoButton) drag_ = Drag::kNone;
  update();
}

void ViewCanvas::mouseDoubleClickEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || picking_) return;
  drag_ = Drag::kNone;
  if (const auto hit = hitAt(event->position())) {
    controller_->CenterOn(hit->point);
    Q_EMIT cameraMoved();
  }
}

void ViewCanvas::wheelEvent(QWheelEvent* event) {
  const double steps = event->angleDelta().y() / 120.0;
  if (steps == 0.0) return;
  const bool same_turn = since_wheel_.isValid() && since_wheel_.elapsed() < kWheelPauseMs &&
                         (event->position() - wheel_position_).manhattanLength() < 3;
  if (!same_turn) {
    wheel_anchor_ = anchorAt(event->position());
    wheel_position_ = event->position();
  }
  since_wheel_.start();
  controller_->ZoomAt(wheel_anchor_, std::pow(kZoomStep, steps));
  event->accept();
  Q_EMIT activated();
  Q_EMIT cameraMoved();
}

void ViewCanvas::leaveEvent(QEvent*) { Q_EMIT hovered(std::nullopt); }

void ViewCanvas::keyPressEvent(QKeyEvent* event) {
  const QSize size = pixelSize();
  const double step = kKeyPan * std::min(size.width(), size.height());
  const bool pan = event->modifiers() & Qt::ShiftModifier;
  const Vec3d pivot = controller_->state().target;
  const auto move = [&](double x, double y) {
    if (pan) {
      controller_->Pan(x * step, y * step, pivot, size.width(), size.height());
    } else {
      controller_->Orbit(x * kKeyOrbit, y * kKeyOrbit, pivot);
    }
  };
  switch (event->key()) {
    case Qt::Key_Left:
      move(-1, 0);
      break;
    case Qt::Key_Right:
      move(1, 0);
      break;
    case Qt::Key_Up:
      move(0, -1);
      break;
    case Qt::Key_Down:
      move(0, 1);
      break;
    case Qt::Key_Plus:
    case Qt::Key_Equal:
      controller_->ZoomAt(pivot, kZoomStep);
      break;
    case Qt::Key_Minus:
      controller_->ZoomAt(pivot, 1.0 / kZoomStep);
      break;
    default:
      QWidget::keyPressEvent(event);
      return;
  }
  Q_EMIT cameraMoved();
}

void ViewCanvas::focusInEvent(QFocusEvent*) {
  Q_EMIT activated();
  update();
}

void ViewCanvas::focusOutEvent(QFocusEvent*) { update(); }

}  // namespace sherd
