// What draws: the user's choice among the machine's GPUs and its CPU, kept for the next start.
#pragma once

#include <QMenu>
#include <functional>

#include "cuda/device_choice.h"
#include "cuda/gpu_list.h"

class QActionGroup;

namespace sherd {

using GpuLister = std::function<GpuList()>;

// The choice as it was saved; automatic where none was, or what was saved is no choice.
DeviceChoice savedDeviceChoice();

class DeviceMenu : public QMenu {
  Q_OBJECT

 public:
  // Shows the saved choice. `list` is asked each time the menu is opened.
  DeviceMenu(GpuLister list, QWidget* parent);

  const DeviceChoice& choice() const { return choice_; }

 Q_SIGNALS:
  // By the user; it is saved already.
  void chosen(const sherd::DeviceChoice& choice);

 private:
  void fill();
  // An entry that cannot be chosen says why, if only by its text.
  void addChoice(const QString& text, const DeviceChoice& choice, bool enabled = true);
  void choose(const DeviceChoice& choice);

  GpuLister list_;
  DeviceChoice choice_;
  QActionGroup* group_ = nullptr;
};

}  // namespace sherd
