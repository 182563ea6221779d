#include "app/desktop/info_strip.h"

#include <QHelpEvent>
#include <QPainter>
#include <QToolTip>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/desktop/theme.h"

namespace sherd {
namespace {

constexpr int kPad = 8, kGap = 6;  // beside and between figures
constexpr int kMargin = 4;         // above, between and below rows

QFont captionFont(const QFont& font) {
  QFont small = font;
  small.setPointSizeF(font.pointSizeF() * 0.8);
  return small;
}

}  // namespace

InfoStrip::InfoStrip(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("paneStrip"));
  setAccessibleName(tr("Figures of this view"));
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void InfoStrip::setFields(const QList<Field>& fields) {
  fields_ = fields;
  QStringList spoken;
  for (const Field& field : fields) spoken << field.caption + QStringLiteral(": ") + field.value;
  setAccessibleDescription(spoken.join(QStringLiteral(", ")));
  update();
}

QString InfoStrip::value(const QString& caption) const {
  for (const Field& field : fields_) {
    if (field.caption == caption) return field.value;
  }
  return {};
}

void InfoStrip::setRows(int rows) {
  if (rows == rows_) return;
  rows_ = rows;
  updateGeometry();
  update();
}

int InfoStrip::rowHeight() const {
  return QFontMetrics(captionFont(font())).height() + fontMetrics().height() + 1;
}

QSize InfoStrip::sizeHint() const { return {360, rows_ * (rowHeight() + kMargin) + kMargin}; }

QList<QRectF> InfoStrip::cells() const {
  const qsizetype columns = std::max<qsizetype>((fields_.size() + rows_ - 1) / rows_, 1);
  const QFontMetricsF small(captionFont(font())), metrics(font());
  QList<double> widths(columns, 0.0);
  for (qsizetype i = 0; i < fields_.size(); ++i) {
    double& width = widths[i % columns];
    width = std::max({width, std::ceil(small.horizontalAdvance(fields_[i].caption)) + kGap,
                      std::ceil(metrics.horizontalAdvance(fields_[i].value)) + kGap});
  }
  const double room = width() - 2.0 * kPad;
  const double wanted = std::accumulate(widths.begin(), widths.end(), 0.0);
  for (double& width : widths) {
    width = wanted > room ? width * room / wanted
                          : width + (room - wanted) / static_cast<double>(columns);
  }
  QList<QRectF> cells;
  double left = kPad;
  for (qsizetype i = 0; i < fields_.size(); ++i) {
    const qsizetype column = i % columns;
    if (column == 0) left = kPad;
    const auto row = static_cast<double>(i / columns);
    cells.append({left, kMargin + row * (rowHeight() + kMargin), widths[column] - kGap,
                  static_cast<double>(rowHeight())});
    left += widths[column];
  }
  return cells;
}

bool InfoStrip::showsAll() const {
  const QFontMetricsF metrics(font());
  const QList<QRectF> areas = cells();
  for (qsizetype i = 0; i < fields_.size(); ++i) {
    if (metrics.horizontalAdvance(fields_[i].value) > areas[i].width()) return false;
  }
  return true;
}

void InfoStrip::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), theme::kWindow);
  const QFont small = captionFont(font());
  const QFontMetricsF small_metrics(small), metrics(font());
  const QList<QRectF> areas = cells();
  for (qsizetype i = 0; i < fields_.size(); ++i) {
    const QRectF& area = areas[i];
    painter.setFont(small);
    painter.setPen(theme::kDim);
    painter.drawText(QPointF(area.left(), area.top() + small_metrics.ascent()),
                     small_metrics.elidedText(fields_[i].caption, Qt::ElideRight, area.width()));
    painter.setFont(font());
    painter.setPen(theme::kText);
    painter.drawText(QPointF(area.left(), area.bottom() - metrics.descent()),
                     metrics.elidedText(fields_[i].value, Qt::ElideRight, area.width()));
  }
}

bool InfoStrip::event(QEvent* event) {
  if (event->type() == QEvent::ToolTip) {
    auto* help = static_cast<QHelpEvent*>(event);
    const QList<QRectF> areas = cells();
    for (qsizetype i = 0; i < fields_.size(); ++i) {
      if (!areas[i].contains(help->pos())) continue;
      const Field& field = fields_[i];
      QToolTip::showText(
          help->globalPos(),
          field.caption + QStringLiteral(": ") + field.value +
              (field.explanation.isEmpty() ? QString() : QLatin1Char('\n') + field.explanation),
          this);
      return true;
    }
  }
  return QWidget::event(event);
}

}  // namespace sherd
