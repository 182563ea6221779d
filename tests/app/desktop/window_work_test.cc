// What is done in the window: scale, exports, levels, errors, settings.
#include "tests/app/desktop/window_test.h"

#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QMessageBox>
#include <QPushButton>
#include <QSignalSpy>
#include <QSpinBox>
#include <QTreeWidget>

#include "app/desktop/dialogs.h"
#include "tests/app/desktop/small_workspace.h"

namespace sherd {

void WindowTest::setsTheScale() {
  const QString path = dir_.filePath(QStringLiteral("scale.ply"));
  writeSmallPly(path, 2500);
  open(path);
  key(Qt::Key_5);
  settle();
  window_->askScale();
  auto* dialog = window_->findChild<QDialog*>(QStringLiteral("scaleDialog"));
  QVERIFY(dialog);
  const QPoint a = middle(0) - QPoint(80, 0), b = middle(0) + QPoint(80, 0);
  const auto hit_a = pane(0)->canvas()->hitAt(a), hit_b = pane(0)->canvas()->hitAt(b);
  QVERIFY(hit_a && hit_b);
  const CameraState before = pane(0)->camera().state();
  QTest::mouseClick(pane(0)->canvas(), Qt::LeftButton, {}, a);
  QTest::mouseClick(pane(0)->canvas(), Qt::LeftButton, {}, b);
  QCOMPARE(pane(0)->camera().state(), before);  // picking moves nothing
  dialog->findChild<QLineEdit*>(QStringLiteral("distance"))->setText(QStringLiteral("1.5"));
  keep(dialog, QStringLiteral("scale_dialog"));
  const double expected = 1.5 / Length(hit_b->point - hit_a->point);
  QTest::keyClick(dialog, Qt::Key_Return);
  QTRY_VERIFY_WITH_TIMEOUT(window_->document()->metres_per_unit().has_value(), kWait);
  QVERIFY(std::abs(*window_->document()->metres_per_unit() / expected - 1) < 1e-6);
  keep(window_.get(), QStringLiteral("scale_set"));
}

void WindowTest::exportsAScreenshot() {
  open(project_);
  window_->askExportScreenshot();
  auto* dialog = shown<QDialog>(window_.get(), QStringLiteral("exportDialog"));
  QVERIFY(dialog);
  // Larger than the window and of another shape.
  dialog->findChild<QSpinBox*>(QStringLiteral("width"))->setValue(1500);
  dialog->findChild<QSpinBox*>(QStringLiteral("height"))->setValue(1800);
  dialog->findChild<QComboBox*>(QStringLiteral("background"))->setCurrentIndex(3);
  const QString path = dir_.filePath(QStringLiteral("shot.png"));
  dialog->findChild<QLineEdit*>(QStringLiteral("path"))->setText(path);
  keep(dialog, QStringLiteral("export_dialog"));
  QSignalSpy finished(window_.get(), &MainWindow::exportFinished);
  dialog->accept();
  QVERIFY(finished.wait(kWait));
  QImage image(path);
  QCOMPARE(image.size(), QSize(1500, 1800));
  QVERIFY(image.hasAlphaChannel());
  QCOMPARE(qAlpha(image.pixel(2, 2)), 0);
  QCOMPARE(qAlpha(image.pixel(750, 900)), 255);
  // The scale bar, which is known here, lies in the lower-left corner.
  QVERIFY(qAlpha(image.pixel(60, 1800 - 60)) > 0);
  QVERIFY(image.save(QStringLiteral(SHERD_OUTPUT_DIR "/exported_screenshot.png")));
}

void WindowTest::exportsTheSheet() {
  open(project_);
  window_->askExportSheet();
  auto* dialog = shown<ExportDialog>(window_.get());
  QVERIFY(dialog);
  QCOMPARE(dialog->levels().size(), std::size_t{4});
  keep(dialog, QStringLiteral("sheet_dialog"));
  const QString path = dir_.filePath(QStringLiteral("sheet.png"));
  PictureExport options = dialog->options();
  dialog->reject();
  options.path = path.toStdString();
  options.width = 1600;
  options.height = 1100;
  options.csv = options.separate = true;
  QSignalSpy finished(window_.get(), &MainWindow::exportFinished);
  window_->exportSheet(options, {0, 1, 2, 3});
  QVERIFY(finished.wait(kWait));
  QImage image(path);
  QCOMPARE(image.size(), QSize(1600, 1100));
  QVERIFY(image.save(QStringLiteral(SHERD_OUTPUT_DIR "/exported_sheet.png")));
  QFile csv(dir_.filePath(QStringLiteral("sheet.csv")));
  QVERIFY(csv.open(QIODevice::ReadOnly));
  QCOMPARE(csv.readAll().trimmed().count('\n'), qsizetype{4});  // names and four levels
  for (const LevelEntry& level : window_->document()->levels()) {
    QVERIFY(QFileInfo::exists(
        dir_.filePath(QStringLiteral("sheet-%1.png").arg(QString::fromStdString(level.name)))));
  }
}

void WindowTest::cancelsAnExport() {
  open(project_);
  PictureExport options;
  options.path = dir_.filePath(QStringLiteral("never.png")).toStdString();
  options.width = options.height = 12000;
  options.supersample = 8;
  window_->exportScreenshot(options);
  auto* dialog = window_->findChild<JobDialog*>();
  QVERIFY(dialog);
  QSignalSpy cancelled(dialog->job(), &BackgroundJob::cancelled);
  QTRY_VERIFY_WITH_TIMEOUT(dialog->isVisible(), kWait);
  keep(dialog, QStringLiteral("progress"));
  QTest::keyClick(dialog, Qt::Key_Escape);
  QVERIFY(cancelled.wait(kWait));
  // Neither the picture nor a part of it.
  QCOMPARE(QDir(dir_.path()).entryList({QStringLiteral("never*")}).size(), qsizetype{0});
}

void WindowTest::cancelsAnImport() {
  const QString folder = dir_.filePath(QStringLiteral("larger"));
  writeSmallWorkspace(folder, 60000);
  open(project_);
  ImportPlan plan;
  plan.options.source = folder.toStdString();
  const QString path = dir_.filePath(QStringLiteral("cancelled.sherd"));
  plan.project_path = path.toStdString();
  plan.levels = {10000, 60000};
  window_->startImport(plan);
  auto* dialog = window_->findChild<JobDialog*>();
  QVERIFY(dialog);
  QSignalSpy cancelled(dialog->job(), &BackgroundJob::cancelled);
  dialog->reject();
  QVERIFY(cancelled.wait(kWait));
  QVERIFY(!QFileInfo::exists(path));
  QVERIFY(!QFileInfo::exists(path + QStringLiteral(".d")));
  // What was open is open still.
  QCOMPARE(QString::fromStdString(window_->document()->path()), project_);
  keep(window_.get(), QStringLiteral("import_cancelled"));
}

void WindowTest::buildsMoreLevels() {
  const QString path = dir_.filePath(QStringLiteral("more.sherd"));
  {
    ImportOptions options;
    options.source = workspace_.toStdString();
    Project project = ImportSurvey(options, path.toStdString());
  }
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  window_->openPath(path);
  QVERIFY(opened.wait(kWait));
  QVERIFY(pane(0)->canvas()->message().contains(QStringLiteral("no levels yet")));
  keep(window_.get(), QStringLiteral("no_levels"));
  window_->askBuildLevels();
  auto* dialog = shown<LevelsDialog>(window_.get());
  QVERIFY(dialog);
  dialog->findChild<QLineEdit*>(QStringLiteral("levels"))->setText(QStringLiteral("1k, 2k, 3k"));
  keep(dialog, QStringLiteral("levels_dialog"));
  dialog->accept();
  QVERIFY(opened.wait(kWait));
  settle();
  QCOMPARE(window_->grid()->paneCount(), 3);
  keep(window_.get(), QStringLiteral("levels_built"));
}

void WindowTest::badFilesEndInADialog() {
  open(project_);
  const auto write = [this](const QString& name, const QByteArray& content) {
    QFile file(dir_.filePath(name));
    if (file.open(QIODevice::WriteOnly)) file.write(content);
    return file.fileName();
  };
  const QStringList bad = {
      write(QStringLiteral("bad.sherd"), "{ \"this\": is no project"),
      write(QStringLiteral("short.ply"),
            "ply\nformat binary_little_endian 1.0\nelement vertex 1000\nproperty float x\n"
            "property float y\nproperty float z\nend_header\n1234"),
      write(QStringLiteral("empty.metaballs"), ""),
      write(QStringLiteral("letter.txt"), "Dear colleague"),
      dir_.filePath(QStringLiteral("not there")),
  };
  for (const QString& path : bad) {
    QSignalSpy problem(window_.get(), &MainWindow::problemShown);
    window_->openPath(path);
    QVERIFY2(problem.wait(kWait), qPrintable(path));
    auto* box = shown<QMessageBox>(window_.get(), QStringLiteral("errorBox"));
    QVERIFY2(box, qPrintable(path));
    const QString line = box->informativeText();
    QVERIFY2(line.contains(QFileInfo(path).fileName()), qPrintable(line));
    QVERIFY2(!line.contains(QLatin1Char('\n')), qPrintable(line));
    keep(box, QStringLiteral("bad_file_") + QFileInfo(path).completeBaseName());
    QTest::keyClick(box, Qt::Key_Return);
    QTRY_VERIFY(!shown<QMessageBox>(window_.get()));
  }
  // The project that was open has not suffered.
  QCOMPARE(QString::fromStdString(window_->document()->path()), project_);
}

void WindowTest::unwritableExportEndsInADialog() {
  open(project_);
  PictureExport options;
  options.width = options.height = 64;
  options.path = dir_.filePath(QStringLiteral("no folder/shot.png")).toStdString();
  QSignalSpy problem(window_.get(), &MainWindow::problemShown);
  window_->exportScreenshot(options);
  QVERIFY(problem.wait(kWait));
  auto* box = shown<QMessageBox>(window_.get(), QStringLiteral("errorBox"));
  QVERIFY(box);
  QVERIFY(box->informativeText().contains(QStringLiteral("no folder")));
  keep(box, QStringLiteral("unwritable"));
}

void WindowTest::remembersWindowAndFiles() {
  open(project_);
  QCOMPARE(MainWindow::recentPaths().first(), project_);
  window_->resize(1111, 777);
  QTRY_COMPARE(window_->size(), QSize(1111, 777));
  QVERIFY(window_->close());
  window_ = std::make_unique<MainWindow>(MakeRenderer);
  window_->show();
  QVERIFY(QTest::qWaitForWindowExposed(window_.get()));
  QTRY_COMPARE(window_->size(), QSize(1111, 777));
  bool offered = false;
  for (const QPushButton* button : window_->findChildren<QPushButton*>()) {
    offered = offered || button->toolTip() == project_;
  }
  QVERIFY(offered);
  keep(window_.get(), QStringLiteral("recent"));
}

void WindowTest::helpAndAbout() {
  QTest::keyClick(window_.get(), Qt::Key_F1);
  auto* keys = shown<QDialog>(window_.get(), QStringLiteral("shortcutsDialog"));
  QVERIFY(keys);
  auto* tree = keys->findChild<QTreeWidget*>();
  QVERIFY(!tree->findItems(QStringLiteral("Orthographic"), Qt::MatchExactly | Qt::MatchRecursive)
               .isEmpty());
  keep(keys, QStringLiteral("keys"));
  keys->close();
  window_->showAbout();
  auto* about = shown<QDialog>(window_.get(), QStringLiteral("aboutDialog"));
  QVERIFY(about);
  QVERIFY(about->findChild<QLabel*>()->text().contains(QStringLiteral("GPU")));
  keep(about, QStringLiteral("about"));
}

}  // namespace sherd
