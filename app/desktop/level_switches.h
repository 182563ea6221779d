// The switches for what is done to a survey's points before levels are made of them.
#pragma once

#include <QWidget>

#include "reconstruction/level.h"

class QCheckBox;

namespace sherd {

class LevelSwitches : public QWidget {
  Q_OBJECT

 public:
  explicit LevelSwitches(QWidget* parent = nullptr);
  LevelOptions options() const;  // target_count is not set

 private:
  QCheckBox* smooth_noise_;
  QCheckBox* close_holes_;
};

}  // namespace sherd
