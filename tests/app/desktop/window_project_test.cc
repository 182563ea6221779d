// What is done to a project in the window: its levels' noise.
#include <QCheckBox>
#include <QLineEdit>
#include <QMessageBox>
#include <QPushButton>
#include <QSignalSpy>

#include "app/desktop/dialogs.h"
#include "app/desktop/info_strip.h"
#include "tests/app/desktop/small_workspace.h"
#include "tests/app/desktop/window_test.h"

namespace sherd {
namespace {

QString noiseOf(const ViewPane* pane) { return pane->strip()->value(QStringLiteral("Noise")); }

// What the box says; it is gone then.
QString messageOf(const QWidget* window) {
  auto* box = shown<QMessageBox>(window, QStringLiteral("messageBox"));
  if (!box) return {};
  const QString text = box->text() + QLatin1Char('\n') + box->informativeText();
  box->accept();
  return text;
}

}  // namespace

void WindowTest::keepsTheNoiseWhereAsked() {
  window_->openPath(workspace_);
  QTRY_VERIFY_WITH_TIMEOUT(shown<ImportDialog>(window_.get()), kWait);
  auto* import = shown<ImportDialog>(window_.get());
  auto* smooth = import->findChild<QCheckBox*>(QStringLiteral("smoothNoise"));
  QVERIFY(smooth->isChecked());
  QVERIFY(!smooth->toolTip().isEmpty());
  QVERIFY(import->plan().level_options.smooth_noise);
  smooth->click();
  QVERIFY(!import->plan().level_options.smooth_noise);
  const QString path = dir_.filePath(QStringLiteral("noise.sherd"));
  import->findChild<QLineEdit*>(QStringLiteral("project"))->setText(path);
  import->findChild<QLineEdit*>(QStringLiteral("levels"))->setText(QStringLiteral("1k, 3k"));
  keep(import, QStringLiteral("import_dialog_noise_kept"));
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  import->accept();
  QVERIFY(opened.wait(kWait));
  QTRY_VERIFY(shown<QMessageBox>(window_.get(), QStringLiteral("messageBox")));
  keep(shown<QMessageBox>(window_.get()), QStringLiteral("import_summary_noise_kept"));
  const QString summary = messageOf(window_.get());
  QVERIFY2(summary.count(QStringLiteral("noise kept")) == 2, qPrintable(summary));
  settle();
  for (int i = 0; i < 2; ++i) QCOMPARE(noiseOf(pane(i)), QStringLiteral("kept"));
  const Project kept = Project::Open(path.toStdString());
  for (const LevelEntry& level : kept.levels()) QVERIFY(!level.options.smooth_noise);
  const auto rough = kept.LoadLevel("1k");

  // One of them again, by the other dialog, as it proposes: then they differ.
  window_->askBuildLevels();
  auto* dialog = shown<LevelsDialog>(window_.get());
  QVERIFY(dialog);
  smooth = dialog->findChild<QCheckBox*>(QStringLiteral("smoothNoise"));
  QVERIFY(smooth->isChecked());
  smooth->click();
  QVERIFY(!dialog->options().smooth_noise);
  smooth->click();
  dialog->findChild<QLineEdit*>(QStringLiteral("levels"))->setText(QStringLiteral("1k"));
  dialog->accept();
  QVERIFY(opened.wait(kWait));
  settle();
  QCOMPARE(noiseOf(pane(0)), QStringLiteral("smoothed"));
  QCOMPARE(noiseOf(pane(1)), QStringLiteral("kept"));
  QVERIFY(pane(0)->level()->cloud.center != rough->cloud.center);
  window_->showImportSummary();
  const QString both = messageOf(window_.get());
  QVERIFY2(both.contains(QStringLiteral("Level 1k: 1,000 metaballs, noise smoothed, ")),
           qPrintable(both));
  QVERIFY2(both.contains(QStringLiteral("Level 3k: 3,000 metaballs, noise kept, ")),
           qPrintable(both));
  // Where panes are narrow their figures stand in two rows, to be read still.
  const int one_row = pane(0)->strip()->height();
  window_->grid()->setPaneCount(3);
  settle();
  QVERIFY(pane(0)->strip()->height() > one_row * 3 / 2);
  keep(window_.get(), QStringLiteral("noise_of_levels"));
  window_->grid()->setPaneCount(4);
  window_->grid()->setArrangement(ViewGrid::Arrangement::kRow);
  settle();
  keep(window_.get(), QStringLiteral("noise_of_levels_in_a_row"));
}

void WindowTest::showsWhatWasBuiltBeforeACancel() {
  const QString folder = dir_.filePath(QStringLiteral("rebuilt"));
  writeSmallWorkspace(folder, 60000);
  const QString path = dir_.filePath(QStringLiteral("rebuilt.sherd"));
  {
    ImportOptions options;
    options.source = folder.toStdString();
    Project project = ImportSurvey(options, path.toStdString());
    BuildLevels(&project, {1000}, {});
  }
  open(path);
  QCOMPARE(noiseOf(pane(0)), QStringLiteral("smoothed"));
  window_->askBuildLevels();
  auto* levels = shown<LevelsDialog>(window_.get());
  QVERIFY(levels);
  levels->findChild<QLineEdit*>(QStringLiteral("levels"))->setText(QStringLiteral("1k, 60k"));
  levels->findChild<QCheckBox*>(QStringLiteral("smoothNoise"))->click();
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  levels->accept();
  auto* dialog = window_->findChild<JobDialog*>();
  QVERIFY(dialog);
  QSignalSpy cancelled(dialog->job(), &BackgroundJob::cancelled);
  connect(dialog->job(), &BackgroundJob::progressed, dialog, [dialog](const QString& what) {
    if (what.startsWith(QStringLiteral("60k"))) dialog->reject();
  });
  QVERIFY(cancelled.wait(kWait));
  // The first level is another now, and its old files are gone.
  QCOMPARE(opened.count(), 1);
  QCOMPARE(window_->document()->levels().size(), std::size_t{1});
  settle();
  QCOMPARE(noiseOf(pane(0)), QStringLiteral("kept"));
}

}  // namespace sherd
