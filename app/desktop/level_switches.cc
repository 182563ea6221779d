#include "app/desktop/level_switches.h"

#include <QCheckBox>
#include <QVBoxLayout>

namespace sherd {

LevelSwitches::LevelSwitches(QWidget* parent)
    : QWidget(parent),
      smooth_noise_(new QCheckBox(tr("&Smooth the points' noise"), this)),
      close_holes_(new QCheckBox(tr("&Close small holes"), this)) {
  const LevelOptions defaults;
  smooth_noise_->setObjectName(QStringLiteral("smoothNoise"));
  smooth_noise_->setChecked(defaults.smooth_noise);
  smooth_noise_->setToolTip(
      tr("Before levels are made every point moves onto the surface its surroundings stand for, or "
         "else is taken where it was surveyed"));
  close_holes_->setObjectName(QStringLiteral("closeHoles"));
  close_holes_->setChecked(defaults.close_holes);
  close_holes_->setToolTip(
      tr("Where the survey has no points, but points all around, and no photograph sees through, "
         "points are added on the surface between. They are counted, and take no part in the "
         "errors stated"));
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(smooth_noise_);
  layout->addWidget(close_holes_);
}

LevelOptions LevelSwitches::options() const {
  LevelOptions options;
  options.smooth_noise = smooth_noise_->isChecked();
  options.close_holes = close_holes_->isChecked();
  return options;
}

}  // namespace sherd
