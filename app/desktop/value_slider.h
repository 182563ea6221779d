// A setting as a label, a slider and a number: made from an entry of the table of settings.
#pragma once

#include <QWidget>
#include <string_view>

class QDoubleSpinBox;
class QSlider;
class QToolButton;

namespace sherd {

class ValueSlider : public QWidget {
  Q_OBJECT

 public:
  // setting: a name of app/project/settings.h. The number takes the setting's whole range, the
  // slider [low, high] of it, logarithmic where low > 0.
  ValueSlider(std::string_view setting, double low, double high, QWidget* parent = nullptr);

  double value() const;
  // Emits nothing.
  void setValue(double value);
  // What the reset button goes back to (the setting's default at first).
  void setFallback(double fallback);

 Q_SIGNALS:
  void valueChanged(double value);

 private:
  int positionOf(double value) const;
  double valueAt(int position) const;
  void changed(double value);

  double low_, high_, fallback_;
  QSlider* slider_;
  QDoubleSpinBox* number_;
  QToolButton* reset_;
};

}  // namespace sherd
