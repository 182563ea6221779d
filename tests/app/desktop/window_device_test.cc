// The choice of what draws, on a machine with invented GPUs whose pictures the CPU draws.
#include <QActionGroup>
#include <QLabel>
#include <QMenu>
#include <QSettings>

#include "app/desktop/device_menu.h"
#include "metaball/error.h"
#include "tests/app/desktop/window_test.h"

namespace sherd {
namespace {

// As long as a machine with many GPUs makes it.
const std::string kMissing = "there is no GPU 7: this machine has " + std::string(300, 'x');

GpuList threeGpus() {
  GpuList gpus;
  gpus.devices = {{0, "Fake A", 9, 0, 8ull << 30, ""},
                  {1, "Fake B", 6, 1, 4ull << 30, "its architecture 6.1 is older than 7.5"},
                  {2, "Fake C", 9, 0, 8ull << 30, ""}};
  return gpus;
}

std::unique_ptr<Renderer> drawn(const DeviceChoice& choice, std::string* why) {
  if (choice.gpu > 2) throw DeviceError("CUDA", 0, kMissing);
  if (why) *why = "for " + choice.Text();
  return MakeCpuRenderer();
}

QStringList textsOf(const QMenu* menu) {
  QStringList texts;
  for (const QAction* action : menu->actions()) {
    if (action->isSeparator()) continue;
    texts << action->text().remove(QLatin1Char('&')) +
                 (action->isChecked() ? QStringLiteral(" [x]") : QString()) +
                 (action->isEnabled() ? QString() : QStringLiteral(" [off]"));
  }
  return texts;
}

}  // namespace

void WindowTest::choosesTheDevice() {
  window_ = std::make_unique<MainWindow>(drawn, threeGpus);
  window_->resize(1400, 900);
  window_->show();
  open(project_);
  auto* label = window_->findChild<QLabel*>(QStringLiteral("device"));
  QTRY_COMPARE(label->text(), QStringLiteral("for auto"));
  auto* menu = window_->findChild<DeviceMenu*>(QStringLiteral("deviceMenu"));
  QVERIFY(menu);
  menu->popup(window_->mapToGlobal(QPoint(300, 200)));
  QCOMPARE(textsOf(menu),
           (QStringList{QStringLiteral("Automatic: a GPU where there is one, else the CPU [x]"),
                        QStringLiteral("CPU"), QStringLiteral("GPU 0: Fake A"),
                        QStringLiteral("GPU 1: Fake B – its architecture 6.1 is older than 7.5 "
                                       "[off]"),
                        QStringLiteral("GPU 2: Fake C"),
                        QStringLiteral("All GPUs, each a part of every picture")}));
  keep(menu, QStringLiteral("device_menu"));
  QTest::keyClick(menu, Qt::Key_2);  // its mnemonic
  QCOMPARE(menu->choice(), (DeviceChoice{Backend::kCuda, 2}));
  // No restart: the views are drawn again, and the next start knows it.
  QTRY_COMPARE_WITH_TIMEOUT(label->text(), QStringLiteral("for cuda:2"), kWait);
  settle();
  QCOMPARE(savedDeviceChoice(), (DeviceChoice{Backend::kCuda, 2}));
  keep(window_.get(), QStringLiteral("device_chosen"));
  window_ = std::make_unique<MainWindow>(drawn, threeGpus);
  window_->resize(1400, 900);
  window_->show();
  open(project_);
  label = window_->findChild<QLabel*>(QStringLiteral("device"));
  QTRY_COMPARE(label->text(), QStringLiteral("for cuda:2"));
}

void WindowTest::saysThatTheSavedDeviceIsNotThere() {
  QSettings().setValue(QStringLiteral("drawOn"), QStringLiteral("cuda:7"));
  window_ = std::make_unique<MainWindow>(drawn, threeGpus);
  window_->resize(1400, 900);
  window_->show();
  open(project_);
  auto* label = window_->findChild<QLabel*>(QStringLiteral("device"));
  const QString said = QStringLiteral("CUDA: ") + QString::fromStdString(kMissing) +
                       QStringLiteral("; automatic: for auto");
  QTRY_COMPARE(label->text(), said);
  QCOMPARE(label->toolTip(), said);
  settle();
  QCOMPARE(window_->width(), 1400);
  keep(window_.get(), QStringLiteral("device_missing_said"));
  auto* menu = window_->findChild<DeviceMenu*>(QStringLiteral("deviceMenu"));
  menu->popup(window_->mapToGlobal(QPoint(300, 200)));
  QCOMPARE(textsOf(menu).last(), QStringLiteral("GPU 7 – not there [x] [off]"));
  keep(menu, QStringLiteral("device_missing"));
  menu->close();
  // It may be back another day.
  QCOMPARE(savedDeviceChoice(), (DeviceChoice{Backend::kCuda, 7}));
  QSettings().setValue(QStringLiteral("drawOn"), QStringLiteral("the moon"));
  QCOMPARE(savedDeviceChoice(), DeviceChoice{});
}

}  // namespace sherd
