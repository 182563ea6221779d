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

qsizetype InfoStrip::columns() const {
  return std::max<qsizetype>((fields_.size() + rows_ - 1) / rows_, 1);
}

QList<double> InfoStrip::columnWidths() const {
  const QFontMetricsF small(captionFont(font())), metrics(font());
  QList<double> widths(columns(), 0.0);
  for (qsizetype i = 0; i < fields_.size(); ++i) {
    double& width = widths[i % columns()];
    width = std::max({width, std::ceil(small.horizontalAdvance(fields_[i].caption)) + kGap,
                      std::ceil(metrics.horizontalAdvance(fields_[i].value)) + kGap});
  }
  const double room = width() - 2.0 * kPad;
  const double wanted = std::accumulate(widths.begin(), widths.end(), 0.0);
  for (double& width : widths) {
    width = wanted > room ? width * room / wanted
                          : width + (room - wanted) / static_cast<double>(widths.size());
  }
  return widths;
}

bool InfoStrip::showsAll() const {
  const QFontMetricsF metrics(font());
  for (qsizetype i = 0; i < fields_.size(); ++i) {
    if (metrics.horizontalAdvance(fields_[i].value) > cell(i).width()) return false;
  }
  return true;
}

QRectF InfoStrip::cell(qsizetype index) const {
  const QList<double> widths = columnWidths();
  const qsizetype column = index % columns();
  const auto row = static_cast<double>(index / columns());
  const double left = std::accumulate(widths.begin(), widths.begin() + column, double{kPad});
  return {left, kMargin + row * (rowHeight() + kMargin), widths[column] - kGap,
          static_cast<double>(rowHeight())};
}

void InfoStrip::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), theme::kWindow);
  const QFont small = captionFont(font());
  const QFontMetricsF small_metrics(small), metrics(font());
  for (qsizetype i = 0; i < fields_.size(); ++i) {
    const QRectF area = cell(i);
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
    for (qsizetype i = 0; i < fields_.size(); ++i) {
      if (!cell(i).contains(help->pos())) continue;
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
