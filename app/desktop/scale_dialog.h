// Sets the survey's scale: metres per unit, or two picked points and their true distance.
#pragma once

#include <QDialog>
#include <optional>

#include "app/desktop/view_canvas.h"

class QLabel;
class QLineEdit;
class QPushButton;

namespace sherd {

// Not modal: points are picked in the views while it is open.
class ScaleDialog : public QDialog {
  Q_OBJECT

 public:
  explicit ScaleDialog(std::optional<double> metres_per_unit, QWidget* parent = nullptr);
  // Empty when the scale is to be forgotten.
  std::optional<double> metresPerUnit() const;
  void addPoint(const SurfaceHit& hit);

 private:
  void showPoints();
  void fromDistance();
  void check();

  QLineEdit* factor_;
  QLabel* points_;
  QLineEdit* distance_;
  QPushButton* set_;
  std::optional<Vec3d> first_, second_;
};

}  // namespace sherd
