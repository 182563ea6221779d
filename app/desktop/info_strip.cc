#include "app/desktop/info_strip.h"

#include <QHelpEvent>
#include <QPainter>
#include <QToolTip>

#include "app/desktop/theme.h"

namespace sherd {
namespace {

constexpr int kPad = 8;

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

QSize InfoStrip::sizeHint() const {
  const int height = QFontMetrics(captionFont(font())).height() + fontMetrics().height() + 9;
  return {360, height};
}

QRectF InfoStrip::cell(qsizetype index) const {
  const double width = (this->width() - 2.0 * kPad) / std::max<qsizetype>(fields_.size(), 1);
  return {kPad + width * static_cast<double>(index), 4, width - 6, height() - 8.0};
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
