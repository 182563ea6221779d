#include "app/desktop/value_slider.h"

#include <QDoubleSpinBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QSignalBlocker>
#include <QSlider>
#include <QToolButton>
#include <cmath>

#include "app/project/settings.h"

namespace sherd {
namespace {

constexpr int kSliderSteps = 400;

QString fromView(std::string_view text) {
  return QString::fromUtf8(text.data(), static_cast<qsizetype>(text.size()));
}

}  // namespace

ValueSlider::ValueSlider(std::string_view setting, double low, double high, QWidget* parent)
    : QWidget(parent), low_(low), high_(high) {
  const SettingInfo& info = Setting(setting);
  fallback_ = info.fallback;
  const QString title = fromView(info.title);
  const QString help = fromView(info.help);
  setObjectName(fromView(info.name));

  auto* label = new QLabel(title, this);
  slider_ = new QSlider(Qt::Horizontal, this);
  slider_->setRange(0, kSliderSteps);
  slider_->setMinimumWidth(40);
  slider_->setAccessibleName(title);
  number_ = new QDoubleSpinBox(this);
  number_->setDecimals(info.decimals);
  number_->setRange(info.min, info.max);
  number_->setStepType(QAbstractSpinBox::AdaptiveDecimalStepType);
  number_->setKeyboardTracking(false);
  number_->setAccessibleName(title);
  number_->setAccessibleDescription(help);
  number_->setFixedWidth(fontMetrics().horizontalAdvance(QStringLiteral("00.000")) + 30);
  if (!info.unit.empty()) number_->setSuffix(QLatin1Char(' ') + fromView(info.unit));
  reset_ = new QToolButton(this);
  reset_->setText(QStringLiteral("↺"));
  reset_->setAutoRaise(true);
  reset_->setAccessibleName(tr("Reset %1").arg(title));
  reset_->setToolTip(tr("Back to the default"));
  for (QWidget* widget : std::initializer_list<QWidget*>{label, slider_, number_}) {
    widget->setToolTip(help);
  }
  label->setBuddy(number_);

  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(6);
  layout->addWidget(label);
  layout->addWidget(slider_, 1);
  layout->addWidget(number_);
  layout->addWidget(reset_);
  setValue(fallback_);

  connect(slider_, &QSlider::valueChanged, this, [this](int position) {
    const QSignalBlocker blocker(number_);
    number_->setValue(valueAt(position));
    changed(number_->value());
  });
  connect(number_, &QDoubleSpinBox::valueChanged, this, [this](double value) {
    const QSignalBlocker blocker(slider_);
    slider_->setValue(positionOf(value));
    changed(value);
  });
  connect(reset_, &QToolButton::clicked, this, [this] {
    setValue(fallback_);
    changed(fallback_);
  });
}

double ValueSlider::value() const { return number_->value(); }

void ValueSlider::setValue(double value) {
  const QSignalBlocker block_number(number_), block_slider(slider_);
  number_->setValue(value);
  slider_->setValue(positionOf(value));
  reset_->setEnabled(std::abs(number_->value() - fallback_) > 1e-9);
}

void ValueSlider::setFallback(double fallback) {
  fallback_ = fallback;
  reset_->setEnabled(std::abs(number_->value() - fallback_) > 1e-9);
}

int ValueSlider::positionOf(double value) const {
  const double share = low_ > 0 ? std::log(std::max(value, 1e-300) / low_) / std::log(high_ / low_)
                                : (value - low_) / (high_ - low_);
  return static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * kSliderSteps));
}

double ValueSlider::valueAt(int position) const {
  const double share = static_cast<double>(position) / kSliderSteps;
  return low_ > 0 ? low_ * std::pow(high_ / low_, share) : low_ + share * (high_ - low_);
}

void ValueSlider::changed(double value) {
  reset_->setEnabled(std::abs(value - fallback_) > 1e-9);
  Q_EMIT valueChanged(value);
}

}  // namespace sherd
