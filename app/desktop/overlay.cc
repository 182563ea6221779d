#include "app/desktop/overlay.h"

#include <QCoreApplication>
#include <QFont>
#include <QFontMetricsF>
#include <algorithm>
#include <array>

#include "app/project/format.h"

namespace sherd {
namespace {

QFont overlayFont(double unit_px, double size) {
  QFont font;
  font.setPixelSize(std::max(1, qRound(size * unit_px)));
  return font;
}

}  // namespace

double longestScaleBar(double width, double unit_px) {
  return std::min(0.33 * width, 240.0 * unit_px);
}

void drawScaleBar(QPainter* painter, const QRectF& area, const ScaleBar& bar, double unit_px,
                  double device_ratio, bool perspective) {
  const double length = bar.length_px / device_ratio;
  const QFont font = overlayFont(unit_px, 12);
  const QFontMetricsF metrics(font);
  QString text = QString::fromStdString(FormatNumber(bar.label_end) + " " + bar.unit);
  if (perspective) text = QCoreApplication::translate("ScaleBar", "%1 at the centre").arg(text);
  const double pad = 7 * unit_px, height = 6 * unit_px, gap = 4 * unit_px;
  const double box_width = std::max(length, metrics.horizontalAdvance(text)) + 2 * pad;
  const double box_height = metrics.height() + gap + height + 2 * pad;
  const QRectF box(area.left() + 10 * unit_px, area.bottom() - 10 * unit_px - box_height, box_width,
                   box_height);
  painter->save();
  painter->setRenderHint(QPainter::Antialiasing);
  painter->setPen(Qt::NoPen);
  painter->setBrush(QColor(20, 21, 23, 170));
  painter->drawRoundedRect(box, 3 * unit_px, 3 * unit_px);
  painter->setFont(font);
  painter->setPen(QColor(236, 238, 240));
  painter->drawText(QPointF(box.left() + pad, box.top() + pad + metrics.ascent()), text);
  // Alternating fields, as on the bars that lie in excavations.
  const QRectF whole(box.left() + pad, box.bottom() - pad - height, length, height);
  painter->setPen(Qt::NoPen);
  for (int field = 0; field < bar.segments; ++field) {
    const double width = whole.width() / bar.segments;
    const QRectF part(whole.left() + width * field, whole.top(), width, whole.height());
    painter->setBrush(field % 2 == 0 ? QColor(245, 245, 245) : QColor(40, 42, 45));
    painter->drawRect(part);
  }
  painter->setBrush(Qt::NoBrush);
  painter->setPen(QPen(QColor(245, 245, 245), unit_px));
  painter->drawRect(whole);
  painter->restore();
}

void drawAxes(QPainter* painter, const QRectF& area, const Camera& camera, double unit_px) {
  struct Axis {
    Vec3d direction;
    QColor color;
    QString name;
  };
  std::array<Axis, 3> axes = {{{{1, 0, 0}, QColor(214, 106, 96), QStringLiteral("X")},
                               {{0, 1, 0}, QColor(122, 178, 102), QStringLiteral("Y")},
                               {{0, 0, 1}, QColor(104, 150, 214), QStringLiteral("Z")}}};
  // Far ones first, so that near ones are drawn over them.
  std::sort(axes.begin(), axes.end(), [&](const Axis& a, const Axis& b) {
    return Dot(a.direction, camera.forward) > Dot(b.direction, camera.forward);
  });
  const double length = 22 * unit_px;
  const QPointF middle(area.right() - 38 * unit_px, area.bottom() - 38 * unit_px);
  painter->save();
  painter->setRenderHint(QPainter::Antialiasing);
  painter->setFont(overlayFont(unit_px, 10));
  const QFontMetricsF metrics(painter->font());
  for (const Axis& axis : axes) {
    const QPointF along(Dot(axis.direction, camera.right), Dot(axis.direction, camera.down));
    const QPointF tip = middle + along * length;
    painter->setPen(QPen(axis.color, 2 * unit_px, Qt::SolidLine, Qt::RoundCap));
    painter->drawLine(middle, tip);
    const QPointF label = middle + along * (length + 8 * unit_px);
    painter->drawText(QRectF(label.x() - 8 * unit_px, label.y() - metrics.height() / 2,
                             16 * unit_px, metrics.height()),
                      Qt::AlignCenter, axis.name);
  }
  painter->restore();
}

}  // namespace sherd
