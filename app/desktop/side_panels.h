// The panels beside the views: light and lens, photographs.
#pragma once

#include <QWidget>
#include <memory>
#include <optional>

#include "metaball/scene.h"
#include "reconstruction/survey.h"

class QCheckBox;
class QLabel;
class QLineEdit;
class QListWidget;
class QListWidgetItem;
class QSlider;

namespace sherd {

class ValueSlider;

class LightPanel : public QWidget {
  Q_OBJECT

 public:
  explicit LightPanel(QWidget* parent = nullptr);
  // Light comes from compass directions about `up` (world, unit); `front` is where "away from the
  // viewer in the front view" points.
  void setAxes(const Vec3d& east, const Vec3d& north, const Vec3d& up);
  Lighting lighting() const;

 Q_SIGNALS:
  void lightingChanged();
  void fieldOfViewChanged(double fov_x_deg);

 private:
  ValueSlider* ambient_;
  ValueSlider* diffuse_;
  ValueSlider* fov_;
  QCheckBox* lit_;
  QCheckBox* raking_;
  QSlider* azimuth_;
  QSlider* elevation_;
  QLabel* azimuth_text_;
  QLabel* elevation_text_;
  Vec3d east_{1, 0, 0}, north_{0, 1, 0}, up_{0, 0, 1};
};

class PhotographPanel : public QWidget {
  Q_OBJECT

 public:
  explicit PhotographPanel(QWidget* parent = nullptr);
  // Null: nothing is open.
  void setSurvey(std::shared_ptr<const Survey> survey);
  const std::shared_ptr<const Survey>& survey() const { return survey_; }
  // Steps to the next (1) or the one before (-1) in the list and chooses it.
  void step(int by);

 Q_SIGNALS:
  void photographChosen(std::size_t photo_idx);
  void opacityChanged(double opacity);

 private:
  void choose(const QListWidgetItem* item);
  void filter(const QString& text);

  std::shared_ptr<const Survey> survey_;
  QLineEdit* filter_;
  QListWidget* list_;
  QSlider* opacity_;
  QLabel* count_;
};

}  // namespace sherd
