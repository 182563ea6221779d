// What is done to a project in the window: its levels' noise, its ground.
#include <QAction>
#include <QCheckBox>
#include <QDirIterator>
#include <QLineEdit>
#include <QMessageBox>
#include <QPushButton>
#include <QRegularExpression>
#include <QSignalSpy>
#include <QStatusBar>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "app/desktop/dialogs.h"
#include "app/desktop/info_strip.h"
#include "tests/app/desktop/small_workspace.h"
#include "tests/app/desktop/window_test.h"

namespace sherd {
namespace {

// Half the turn about x that the project of the levelling tests is imported with.
constexpr double kHalf = -0.61;

void write(const QString& path, const QString& text) {
  QFile file(path);
  if (!file.open(QIODevice::WriteOnly)) qFatal("cannot write %s", qPrintable(path));
  file.write(text.toUtf8());
}

void makeProject(ImportOptions options, const QString& source, const QString& path,
                 const std::vector<std::uint64_t>& levels) {
  options.source = source.toStdString();
  Project project = ImportSurvey(options, path.toStdString());
  BuildLevels(&project, levels, {});
}

// About `points` points near a plane, in a national grid and turned by twice kHalf; two levels.
QString writeTiltedProject(const QString& folder, int points) {
  writeSmallWorkspace(folder, points, 0.05);
  const QString transform = folder + QStringLiteral("/tilt.txt");
  write(transform, QStringLiteral("1 %1 %2 0 0 653412.25 6861234.5 87\n")
                       .arg(std::cos(kHalf), 0, 'g', 17)
                       .arg(std::sin(kHalf), 0, 'g', 17));
  ImportOptions options;
  options.transform = transform.toStdString();
  options.metres_per_unit = 0.5;
  const QString path = folder + QStringLiteral("/tilted.sherd");
  makeProject(options, folder, path, {1000, 4000});
  return path;
}

// Every byte of a project.
std::map<QString, QByteArray> stateOf(const QString& project) {
  std::map<QString, QByteArray> state;
  QStringList files{project};
  QDirIterator more(project + QStringLiteral(".d"), QDir::Files, QDirIterator::Subdirectories);
  while (more.hasNext()) files << more.next();
  for (const QString& name : files) {
    QFile file(name);
    if (!file.open(QIODevice::ReadOnly)) qFatal("cannot read %s", qPrintable(name));
    state[name] = file.readAll();
  }
  return state;
}

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
  auto* close = import->findChild<QCheckBox*>(QStringLiteral("closeHoles"));
  QVERIFY(close->isChecked());
  QVERIFY(import->plan().level_options.close_holes);
  close->click();
  QVERIFY(!import->plan().level_options.close_holes);
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
  for (const LevelEntry& level : kept.levels()) {
    QVERIFY(!level.options.smooth_noise);
    QVERIFY(!level.options.close_holes);
  }
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
  makeProject({}, folder, path, {1000});
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

void WindowTest::levelsByTheGround() {
  const QString path = writeTiltedProject(dir_.filePath(QStringLiteral("tilted")), 4000);
  open(path);
  keep(window_.get(), QStringLiteral("before_levelling"));
  const Vec3d up_before = *window_->document()->up();
  QVERIFY(up_before.z < 0.5);
  QSignalSpy opened(window_.get(), &MainWindow::documentOpened);
  key(Qt::Key_G, Qt::ControlModifier);
  QVERIFY(opened.wait(kWait));
  QTRY_VERIFY(shown<QMessageBox>(window_.get(), QStringLiteral("messageBox")));
  keep(shown<QMessageBox>(window_.get()), QStringLiteral("levelled_message"));
  const QString message = messageOf(window_.get());
  // The turn is that of the square from where the import put it, and not the little by which it
  // was off what was up there.
  const double z = std::cos(2 * kHalf) / std::hypot(1.0, 0.1);
  const double turn = std::acos(z) * 180 / std::numbers::pi;
  const auto said = QRegularExpression(QStringLiteral("turned by ([0-9.]+)°")).match(message);
  QVERIFY2(std::abs(said.captured(1).toDouble() - turn) < 0.5, qPrintable(message));
  const auto tilt = QRegularExpression(QStringLiteral("tilted by ([0-9.]+)°")).match(message);
  const double off = tilt.captured(1).toDouble();
  QVERIFY2(off > 0.5 && off < 15, qPrintable(message));
  window_->activateWindow();
  QVERIFY(QTest::qWaitForWindowActive(window_.get()));
  // The window shows it turned, as it is on disk.
  settle();
  keep(window_.get(), QStringLiteral("levelled"));
  QCOMPARE(*window_->document()->up(), (Vec3d{0, 0, 1}));
  QCOMPARE(*window_->document()->metres_per_unit(), 0.5);
  QCOMPARE(*Project::Open(path.toStdString()).up(), (Vec3d{0, 0, 1}));
  key(Qt::Key_5);
  settle();
  for (int i = 0; i < window_->grid()->paneCount(); ++i) {
    const CameraState& camera = pane(i)->camera().state();
    QVERIFY(camera.forward.z < -0.999999);
    for (const QPoint& by : {QPoint(0, 0), QPoint(-90, 50), QPoint(90, -50)}) {
      const auto hit = pane(i)->canvas()->hitAt(middle(i) + by);
      QVERIFY(hit);
      QVERIFY2(std::abs(hit->point.z) < 0.1, qPrintable(QString::number(hit->point.z)));
    }
  }
  // Photographs have turned with it.
  key(Qt::Key_PageDown);
  QTRY_VERIFY_WITH_TIMEOUT(pane(0)->camera().state().forward.z > -0.99, kWait);
  QVERIFY(std::abs(pane(0)->camera().state().eye().z - 2.2) < 0.3);

  // A second time there is nothing to turn; points picked for a scale are not kept for it.
  window_->askScale();
  QVERIFY(shown<QDialog>(window_.get(), QStringLiteral("scaleDialog")));
  window_->levelByTheGround();
  QVERIFY(!shown<QDialog>(window_.get(), QStringLiteral("scaleDialog")));
  window_->levelByTheGround();  // one is running
  QCOMPARE(window_->findChildren<JobDialog*>().size(), qsizetype{1});
  QVERIFY(opened.wait(kWait));
  const QString again = messageOf(window_.get());
  QVERIFY2(again.startsWith(QStringLiteral("The ground was level already.")), qPrintable(again));
  QVERIFY2(!again.contains(QStringLiteral("tilted")), qPrintable(again));
}

void WindowTest::levelsNothingWithoutAGround() {
  QVERIFY(QDir(dir_.path()).mkpath(QStringLiteral("ball")));
  const QString ply = dir_.filePath(QStringLiteral("ball/ball.ply"));
  constexpr int kCount = 3000;
  QString text = QStringLiteral(
                     "ply\nformat ascii 1.0\nelement vertex %1\nproperty float x\n"
                     "property float y\nproperty float z\nend_header\n")
                     .arg(kCount);
  for (int i = 0; i < kCount; ++i) {
    // Evenly over the ball, along a spiral.
    const double z = 1 - (2 * i + 1.0) / kCount, r = std::sqrt(1 - z * z), a = 2.39996323 * i;
    text += QStringLiteral("%1 %2 %3\n").arg(r * std::cos(a)).arg(r * std::sin(a)).arg(z);
  }
  write(ply, text);
  const QString path = dir_.filePath(QStringLiteral("ball/ball.sherd"));
  makeProject({}, ply, path, {1000});
  open(path);
  const auto before = stateOf(path);
  const auto document = window_->document();
  QSignalSpy problem(window_.get(), &MainWindow::problemShown);
  key(Qt::Key_G, Qt::ControlModifier);
  QVERIFY(problem.wait(kWait));
  auto* box = shown<QMessageBox>(window_.get(), QStringLiteral("errorBox"));
  QVERIFY(box);
  const QString line = box->informativeText();
  QVERIFY2(line.contains(QStringLiteral("ball.sherd: no ground to level")), qPrintable(line));
  QVERIFY2(!line.contains(QLatin1Char('\n')), qPrintable(line));
  keep(box, QStringLiteral("no_ground"));
  box->accept();
  QCOMPARE(window_->document(), document);
  QVERIFY(stateOf(path) == before);

  // What is no project cannot be levelled.
  const auto enabled = [this] {
    for (const QAction* action : window_->findChildren<QAction*>()) {
      if (action->shortcut() == QKeySequence(Qt::CTRL | Qt::Key_G)) return action->isEnabled();
    }
    return false;
  };
  QVERIFY(enabled());
  const QString bare = dir_.filePath(QStringLiteral("bare to level.ply"));
  writeSmallPly(bare, 2500);
  open(bare);
  QVERIFY(!enabled());
}

void WindowTest::cancelsALevelling() {
  const QString path = writeTiltedProject(dir_.filePath(QStringLiteral("to cancel")), 60000);
  open(path);
  const auto before = stateOf(path);
  const auto document = window_->document();
  window_->levelByTheGround();
  auto* dialog = window_->findChild<JobDialog*>();
  QVERIFY(dialog);
  QSignalSpy cancelled(dialog->job(), &BackgroundJob::cancelled);
  dialog->reject();
  QVERIFY(cancelled.wait(kWait));
  QCOMPARE(window_->document(), document);
  QVERIFY(stateOf(path) == before);
  QVERIFY(window_->statusBar()->currentMessage().contains(QStringLiteral("cancelled")));
  settle();
}

}  // namespace sherd
