// The window itself: what it opens and what it shows.
#include "tests/app/desktop/window_test.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QMessageBox>
#include <QMimeData>
#include <QPushButton>
#include <QRadioButton>
#include <QSettings>
#include <QSignalSpy>

#include "app/desktop/dialogs.h"
#include "app/desktop/info_strip.h"
#include "app/desktop/side_panels.h"
#include "app/desktop/theme.h"
#include "app/desktop/value_slider.h"
#include "app/project/format.h"
#include "tests/app/desktop/small_workspace.h"

namespace sherd {
namespace {

constexpr int kPoints = 4000;

}  // namespace

void WindowTest::initTestCase() {
  QVERIFY(dir_.isValid());
  QCoreApplication::setOrganizationName(QStringLiteral("sherd-test"));
  QCoreApplication::setApplicationVersion(QStringLiteral("0"));
  QSettings::setDefaultFormat(QSettings::IniFormat);
  QSettings::setPath(QSettings::IniFormat, QSettings::UserScope, dir_.path());
  QVERIFY(QDir().mkpath(QStringLiteral(SHERD_OUTPUT_DIR)));
  theme::apply(qApp);
  workspace_ = dir_.filePath(QStringLiteral("survey"));
  writeSmallWorkspace(workspace_, kPoints);
  // The project that most tests open.
  ImportOptions options;
  options.source = workspace_.toStdString();
  project_ = dir_.filePath(QStringLiteral("dig.sherd"));
  options.metres_per_unit = 0.5;
  Project project = ImportSurvey(options, project_.toStdString());
  BuildLevels(&project, {500, 1000, 2000, 4000}, {});
}

void WindowTest::init() {
  QSettings().clear();
  window_ = std::make_unique<MainWindow>(MakeRenderer);
  window_->resize(1400, 900);
  window_->show();
  window_->activateWindow();
  QVERIFY(QTest::qWaitForWindowActive(window_.get()));
}

void WindowTest::cleanup() {
  if (window_) {
    const QString name = QString::fromLatin1(QTest::currentTestFunction());
    if (QTest::currentTestFailed()) keep(window_.get(), name + QStringLiteral("_failed"));
  }
  window_.reset();
}

void WindowTest::keep(QWidget* widget, const QString& name) {
  const double ratio = widget->devicePixelRatioF();
  const QString scale = ratio == 1.0 ? QString() : QStringLiteral("_at_%1x").arg(ratio);
  const QString path = QStringLiteral(SHERD_OUTPUT_DIR "/%1%2.png").arg(name, scale);
  QVERIFY(widget->grab().save(path));
}

void WindowTest::settle() {
  const auto settled = [this] {
    if (!window_->grid()->queue()->isIdle()) return false;
    for (const ViewPane* p : window_->grid()->panes()) {
      // What the worker has drawn may still be on its way to the pane.
      const auto& view = p->canvas()->view();
      if (!p->level() || !view || view->level != p->level() || !view->final ||
          view->image.size() != p->canvas()->pixelSize()) {
        return false;
      }
    }
    return true;
  };
  QTRY_VERIFY_WITH_TIMEOUT(settled(), kWait);
}

void WindowTest::open(const QString& path) {
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  window_->openPath(path);
  QVERIFY(opened.wait(kWait));
  settle();
}

void WindowTest::emptyWindow() {
  QVERIFY(shown<QLabel>(window_.get()));
  QVERIFY(!window_->grid()->isVisible());
  keep(window_.get(), QStringLiteral("empty"));
}

void WindowTest::importByDialog() {
  window_->openPath(workspace_);
  QTRY_VERIFY_WITH_TIMEOUT(shown<ImportDialog>(window_.get()), kWait);
  auto* dialog = shown<ImportDialog>(window_.get());
  const QString found = dialog->findChild<QLabel*>(QStringLiteral("found"))->text();
  QVERIFY2(found.contains(QStringLiteral("4 photographs")), qPrintable(found));
  QVERIFY2(found.contains(QStringLiteral("No dense cloud")), qPrintable(found));
  auto* levels = dialog->findChild<QLineEdit*>(QStringLiteral("levels"));
  QVERIFY(!levels->text().isEmpty());
  auto* import = dialog->findChild<QPushButton*>(QStringLiteral("import"));
  levels->setText(QStringLiteral("1k, many"));
  QVERIFY(!import->isEnabled());
  keep(dialog, QStringLiteral("import_dialog_problem"));
  levels->setText(QStringLiteral("1k, 3k"));
  QVERIFY(import->isEnabled());
  const QString project = dir_.filePath(QStringLiteral("by dialog.sherd"));
  dialog->findChild<QLineEdit*>(QStringLiteral("project"))->setText(project);
  dialog->findChild<QLineEdit*>(QStringLiteral("scale"))->setText(QStringLiteral("0.25"));
  keep(dialog, QStringLiteral("import_dialog"));
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  QTest::mouseClick(import, Qt::LeftButton);
  QVERIFY(opened.wait(kWait));
  QTRY_VERIFY_WITH_TIMEOUT(shown<QMessageBox>(window_.get(), QStringLiteral("messageBox")), kWait);
  auto* box = shown<QMessageBox>(window_.get(), QStringLiteral("messageBox"));
  QVERIFY(box->informativeText().contains(QStringLiteral("All photographs were found")));
  keep(box, QStringLiteral("import_summary"));
  QTest::keyClick(box, Qt::Key_Return);
  settle();
  QCOMPARE(window_->grid()->paneCount(), 2);
  QCOMPARE(window_->document()->levels().size(), std::size_t{2});
  QCOMPARE(*window_->document()->metres_per_unit(), 0.25);
  QVERIFY(QFileInfo::exists(project));
  keep(window_.get(), QStringLiteral("imported"));
}

void WindowTest::fourLinkedPanes() {
  open(project_);
  QCOMPARE(window_->grid()->paneCount(), 4);
  for (int i = 0; i < 4; ++i) {
    QVERIFY(pane(i)->isLinked());
    QCOMPARE(pane(i)->levelIndex(), static_cast<std::size_t>(i));
    QCOMPARE(pane(i)->camera().state(), pane(0)->camera().state());
    const auto& view = pane(i)->canvas()->view();
    QVERIFY(view->stats.hits > view->stats.rays / 20);
    // Pixels of the device, whatever the interface's scale.
    QCOMPARE(view->image.size(),
             pane(i)->canvas()->size() * pane(i)->canvas()->devicePixelRatioF());
    const LevelStats& stats = window_->document()->levels()[static_cast<std::size_t>(i)].stats;
    QCOMPARE(pane(i)->strip()->value(QStringLiteral("Metaballs")),
             QString::fromStdString(FormatGrouped(stats.count)));
    QCOMPARE(pane(i)->strip()->value(QStringLiteral("Noise")), QStringLiteral("smoothed"));
    for (const char* caption : {"Spacing", "Radius", "Error", "Time", "Device", "Hits"}) {
      const QString value = pane(i)->strip()->value(QLatin1String(caption));
      QVERIFY2(!value.isEmpty() && value != QStringLiteral("–"), caption);
    }
  }
  for (int i = 0; i < 4; ++i) QVERIFY(pane(i)->strip()->showsAll());
  QVERIFY(changedShare(picture(0), picture(3)) > 0.01);
  auto* device = window_->findChild<QLabel*>(QStringLiteral("device"));
  QVERIFY(!device->text().isEmpty());
  keep(window_.get(), QStringLiteral("four_linked_panes"));
}

void WindowTest::figuresTakeTheRoomTheyNeed() {
  InfoStrip strip;
  strip.setFields({{QStringLiteral("Hits"), QStringLiteral("4 %"), {}},
                   {QStringLiteral("Error"), QStringLiteral("0.00103 units"), {}},
                   {QStringLiteral("Device"), QStringLiteral("CPU"), {}}});
  int narrowest = 40;
  for (strip.resize(narrowest, 40); !strip.showsAll(); strip.resize(narrowest, 40)) {
    QVERIFY(++narrowest < 1000);
  }
  // Columns of one width would need three times the longest.
  QVERIFY(narrowest < 3 * strip.fontMetrics().horizontalAdvance(QStringLiteral("0.00103 units")));
  strip.resize(narrowest + 200, 40);
  QVERIFY(strip.showsAll());
}

void WindowTest::opensABareCloud() {
  const QString path = dir_.filePath(QStringLiteral("bare.ply"));
  writeSmallPly(path, 2500);
  open(path);
  QCOMPARE(window_->grid()->paneCount(), 1);
  QVERIFY(pane(0)->canvas()->view()->stats.hits > 0);
  QVERIFY(!pane(0)->findChild<QComboBox*>(QStringLiteral("color"))->isEnabled());
  QCOMPARE(pane(0)->strip()->value(QStringLiteral("Noise")), QStringLiteral("–"));  // not known
  keep(window_.get(), QStringLiteral("bare_cloud"));
}

void WindowTest::offersLevelsForAPointCloud() {
  QVERIFY(QDir(dir_.path()).mkpath(QStringLiteral("alone")));
  const QString path = dir_.filePath(QStringLiteral("alone/points.ply"));
  writeSmallPly(path, 2500, false);
  window_->openPath(path);
  QTRY_VERIFY_WITH_TIMEOUT(shown<ImportDialog>(window_.get()), kWait);
  auto* dialog = shown<ImportDialog>(window_.get());
  QVERIFY(dialog->findChild<QRadioButton*>(QStringLiteral("dense"))->isChecked());
  QVERIFY(!dialog->findChild<QRadioButton*>(QStringLiteral("sparse"))->isEnabled());
  keep(dialog, QStringLiteral("import_point_cloud"));
  // Or just a look at it.
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  QTest::mouseClick(dialog->findChild<QPushButton*>(QStringLiteral("asItIs")), Qt::LeftButton);
  QVERIFY(opened.wait(kWait));
  settle();
  QVERIFY(!window_->document()->project());
  QCOMPARE(pane(0)->level()->cloud.size(), std::size_t{2500});
}

void WindowTest::opensWhatIsDropped() {
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  QMimeData data;
  data.setUrls({QUrl::fromLocalFile(project_)});
  QDragEnterEvent enter({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QVERIFY(QApplication::sendEvent(window_.get(), &enter));
  QVERIFY(enter.isAccepted());
  QDropEvent drop({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
  QVERIFY(QApplication::sendEvent(window_.get(), &drop));
  QVERIFY(opened.wait(kWait));
  settle();
  keep(window_.get(), QStringLiteral("dropped"));
}

void WindowTest::switchesLevels() {
  open(project_);
  const QImage before = picture(0);
  auto* box = pane(0)->findChild<QComboBox*>(QStringLiteral("level"));
  QCOMPARE(box->count(), 4);
  QTest::keyClick(box, Qt::Key_End);
  QCOMPARE(pane(0)->levelIndex(), std::size_t{3});
  settle();
  QVERIFY(changedShare(before, picture(0)) > 0.01);
  QCOMPARE(pane(0)->level()->cloud.size(), pane(3)->level()->cloud.size());
  QCOMPARE(pane(0)->level().get(), pane(3)->level().get());  // loaded once
  pane(0)->canvas()->setFocus();
  key(Qt::Key_BracketLeft);
  QCOMPARE(pane(0)->levelIndex(), std::size_t{2});
  QCOMPARE(box->currentIndex(), 2);
  settle();
  keep(window_.get(), QStringLiteral("switched_level"));
}

void WindowTest::changesThresholdAndRadius() {
  open(project_);
  const auto hits = [this] { return pane(2)->canvas()->view()->stats.hits; };
  const auto before = hits();
  const QImage other = picture(1);
  auto* threshold =
      pane(2)->findChild<ValueSlider*>(QStringLiteral("threshold"))->findChild<QDoubleSpinBox*>();
  threshold->setFocus();
  threshold->selectAll();
  QTest::keyClicks(threshold, QStringLiteral("2.5"));
  QTest::keyClick(threshold, Qt::Key_Return);
  QCOMPARE(pane(2)->surface().threshold, 2.5);
  settle();
  QVERIFY(hits() < before);
  const auto thin = hits();
  auto* radius =
      pane(2)->findChild<ValueSlider*>(QStringLiteral("radius-scale"))->findChild<QSlider*>();
  const QString shown_radius = pane(2)->strip()->value(QStringLiteral("Radius"));
  radius->setFocus();
  for (int i = 0; i < 40; ++i) QTest::keyClick(radius, Qt::Key_Right);
  QVERIFY(pane(2)->surface().radius_scale > 1.2);
  settle();
  QVERIFY(hits() > thin);
  QVERIFY(pane(2)->strip()->value(QStringLiteral("Radius")) != shown_radius);
  QCOMPARE(changedShare(other, picture(1)), 0.0);  // the other panes keep theirs
  keep(window_.get(), QStringLiteral("threshold_changed"));
}

void WindowTest::layoutKeys() {
  open(project_);
  for (const auto& [number, count] :
       {std::pair(Qt::Key_1, 1), {Qt::Key_2, 2}, {Qt::Key_3, 3}, {Qt::Key_4, 4}}) {
    key(number, Qt::ControlModifier);
    QCOMPARE(window_->grid()->paneCount(), count);
    settle();
    for (const ViewPane* p : window_->grid()->panes()) QVERIFY(p->isVisible());
    keep(window_.get(), QStringLiteral("layout_%1").arg(count));
  }
  // The next pane by key.
  pane(0)->canvas()->setFocus();
  key(Qt::Key_F6);
  QCOMPARE(window_->grid()->activePane(), pane(1));
}

void WindowTest::showsThePositionUnderTheCursor() {
  open(project_);
  const auto hit = pane(0)->canvas()->hitAt(middle(0));
  QVERIFY(hit);
  // The surface is z = 0.25 sin 4x cos 3y + 0.1 x; it lies a little outside its points.
  const Vec3d p = hit->point;
  QVERIFY(std::abs(p.z - 0.25 * std::sin(4 * p.x) * std::cos(3 * p.y) - 0.1 * p.x) < 0.15);
  auto* label = window_->findChild<QLabel*>(QStringLiteral("position"));
  QTest::mouseMove(pane(0)->canvas(), middle(0));
  QTRY_VERIFY(label->text().startsWith(QStringLiteral("X ")));
  QVERIFY(label->text().contains(QStringLiteral("metaball %1").arg(hit->id)));
  QVERIFY(label->text().contains(QStringLiteral("distance")));
  keep(window_.get(), QStringLiteral("position"));
  QTest::mouseMove(pane(0)->canvas(), {2, 2});
  QTRY_VERIFY(label->text().isEmpty());
}

void WindowTest::coloursFromPhotographs() {
  open(project_);
  const QImage before = picture(0);
  auto* box = pane(0)->findChild<QComboBox*>(QStringLiteral("color"));
  QTest::keyClick(box, Qt::Key_End);
  QCOMPARE(pane(0)->colorSource(), PaneColors::kPhotographs);
  QTRY_VERIFY_WITH_TIMEOUT(pane(0)->canvas()->view()->photo_stats.has_value(), kWait);
  settle();
  const PhotoShadingStats& stats = *pane(0)->canvas()->view()->photo_stats;
  QVERIFY(stats.from_photos > stats.pixels / 2);
  QVERIFY(changedShare(before, picture(0)) > 0.01);
  keep(window_.get(), QStringLiteral("photograph_colours"));
  pane(0)->canvas()->setFocus();
  key(Qt::Key_C);
  QCOMPARE(pane(0)->colorSource(), PaneColors::kBlend);
}

void WindowTest::rakingLight() {
  open(project_);
  const QImage before = picture(0);
  key(Qt::Key_L, Qt::ControlModifier);
  auto* panel = window_->findChild<LightPanel*>();
  QTRY_VERIFY(panel->isVisible());
  settle();
  const QImage headlight = picture(0);
  panel->findChild<QCheckBox*>(QStringLiteral("raking"))->click();
  settle();
  QVERIFY(changedShare(headlight, picture(0)) > 0.05);
  keep(window_.get(), QStringLiteral("raking_light"));
}

}  // namespace sherd

QTEST_MAIN(sherd::WindowTest)
