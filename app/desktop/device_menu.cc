#include "app/desktop/device_menu.h"

#include <QActionGroup>
#include <QSettings>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

QString settingsKey() { return QStringLiteral("drawOn"); }

QString labelOf(const CudaDevice& device) {
  QString text = DeviceMenu::tr("GPU &%1").arg(device.idx);
  if (!device.name.empty()) text += QStringLiteral(": ") + QString::fromStdString(device.name);
  if (!device.why_not.empty()) {
    text += QStringLiteral(" – ") + QString::fromStdString(device.why_not);
  }
  return text;
}

}  // namespace

DeviceChoice savedDeviceChoice() {
  const QString text = QSettings().value(settingsKey()).toString();
  try {
    return text.isEmpty() ? DeviceChoice{} : ParseDeviceChoice(text.toStdString());
  } catch (const InputError&) {
    return {};
  }
}

DeviceMenu::DeviceMenu(GpuLister list, QWidget* parent)
    : QMenu(tr("Rend&er on"), parent), list_(std::move(list)), choice_(savedDeviceChoice()) {
  setObjectName(QStringLiteral("deviceMenu"));
  connect(this, &QMenu::aboutToShow, this, &DeviceMenu::fill);
}

void DeviceMenu::fill() {
  clear();
  delete group_;
  group_ = new QActionGroup(this);
  const GpuList gpus = list_();
  addChoice(tr("&Automatic: a GPU where there is one, else the CPU"), {});
  addChoice(tr("&CPU"), {Backend::kCpu});
  addSeparator();
  for (const CudaDevice& device : gpus.devices) {
    addChoice(labelOf(device), {Backend::kCuda, device.idx}, device.why_not.empty());
  }
  const DeviceChoice all{Backend::kCuda, DeviceChoice::kAll};
  if (gpus.devices.size() > 1) addChoice(tr("A&ll GPUs, each a part of every picture"), all);
  if (gpus.devices.empty()) {
    addAction(tr("No GPU: %1").arg(QString::fromStdString(gpus.reason)))->setEnabled(false);
  }
  if (!group_->checkedAction()) {
    // What was saved on another day: it stays the choice until the user makes another.
    const QString what = choice_ == all                        ? tr("All GPUs")
                         : choice_.gpu == DeviceChoice::kFirst ? tr("GPU")
                                                               : tr("GPU %1").arg(choice_.gpu);
    addChoice(tr("%1 – not there").arg(what), choice_, false);
  }
}

void DeviceMenu::addChoice(const QString& text, const DeviceChoice& choice, bool enabled) {
  QAction* action = addAction(text);
  action->setCheckable(true);
  action->setChecked(choice == choice_);
  action->setEnabled(enabled);
  group_->addAction(action);
  connect(action, &QAction::triggered, this, [this, choice] { choose(choice); });
}

void DeviceMenu::choose(const DeviceChoice& choice) {
  choice_ = choice;
  QSettings().setValue(settingsKey(), QString::fromStdString(choice.Text()));
  Q_EMIT chosen(choice);
}

}  // namespace sherd
