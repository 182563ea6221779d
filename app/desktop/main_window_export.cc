// Exports, scale, levelling and further levels: the main window's work on an open document.
#include <QFileInfo>
#include <QStatusBar>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/desktop/dialogs.h"
#include "app/desktop/export.h"
#include "app/desktop/formatting.h"
#include "app/desktop/main_window.h"
#include "app/desktop/scale_dialog.h"

namespace sherd {
namespace {

// Turns below this are told as none.
constexpr double kNoTurn = 0.01;  // degrees

double degrees(double radians) { return radians * 180 / std::numbers::pi; }
QString formatDegrees(double radians) {
  return QString::fromStdString(FormatNumber(degrees(radians), 3)) + QChar(0xb0);
}

}  // namespace

ExportScene MainWindow::exportScene() const {
  ExportScene scene;
  scene.document = document_;
  const CameraController& camera = grid_->activePane()->camera();
  const QSize size = grid_->activePane()->canvas()->pixelSize();
  scene.camera = camera.MakeCamera(size.width(), size.height());
  scene.target_depth = camera.state().distance;
  scene.lighting = grid_->display().lighting;
  scene.device = device_menu_->choice();
  scene.factory = factory_;
  return scene;
}

void MainWindow::askExportScreenshot() {
  if (!document_) return;
  auto* dialog = new ExportDialog(ExportDialog::Kind::kScreenshot, *document_,
                                  grid_->activePane()->canvas()->pixelSize(), {}, this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  connect(dialog, &QDialog::accepted, this,
          [this, dialog] { exportScreenshot(dialog->options()); });
  dialog->open();
}

void MainWindow::exportScreenshot(const PictureExport& options) {
  const ViewPane* pane = grid_->activePane();
  ExportView view;
  view.level_idx = pane->levelIndex();
  view.surface = pane->surface();
  view.photograph_colors = pane->colorSource() == PaneColors::kPhotographs;
  const QString path = QString::fromStdString(options.path);
  newJob(tr("Exporting the screenshot"))
      ->start([scene = exportScene(), view, options](
                  const Control& control) { ExportScreenshot(scene, view, options, control); },
              [this, path] {
                statusBar()->showMessage(tr("Written: %1").arg(path), 15000);
                Q_EMIT exportFinished(path);
              });
}

void MainWindow::askExportSheet() {
  if (!document_) return;
  std::vector<std::size_t> shown;
  for (const ViewPane* pane : grid_->panes()) shown.push_back(pane->levelIndex());
  auto* dialog = new ExportDialog(ExportDialog::Kind::kSheet, *document_,
                                  grid_->activePane()->canvas()->pixelSize(), shown, this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  connect(dialog, &QDialog::accepted, this,
          [this, dialog] { exportSheet(dialog->options(), dialog->levels()); });
  dialog->open();
}

void MainWindow::exportSheet(const PictureExport& options, const std::vector<std::size_t>& levels) {
  // A level that is on the screen goes as it is there; others with their defaults.
  std::vector<ExportView> views;
  for (const std::size_t level : levels) {
    ExportView view;
    view.level_idx = level;
    view.surface.threshold = document_->levels()[level].stats.threshold;
    view.photograph_colors = grid_->activePane()->colorSource() == PaneColors::kPhotographs;
    for (const ViewPane* pane : grid_->panes()) {
      if (pane->levelIndex() != level) continue;
      view.surface = pane->surface();
      view.photograph_colors = pane->colorSource() == PaneColors::kPhotographs;
      break;
    }
    views.push_back(view);
  }
  const QString path = QString::fromStdString(options.path);
  newJob(tr("Exporting the comparison sheet"))
      ->start([scene = exportScene(), views,
               options](const Control& control) { ExportSheet(scene, views, options, control); },
              [this, path] {
                statusBar()->showMessage(tr("Written: %1").arg(path), 15000);
                Q_EMIT exportFinished(path);
              });
}

void MainWindow::askScale() {
  if (!document_ || scale_dialog_) return;
  scale_dialog_ = new ScaleDialog(document_->metres_per_unit(), this);
  scale_dialog_->setAttribute(Qt::WA_DeleteOnClose);
  for (ViewPane* pane : grid_->panes()) pane->canvas()->setPicking(true);
  connect(grid_, &ViewGrid::pointPicked, scale_dialog_, &ScaleDialog::addPoint);
  connect(scale_dialog_, &QDialog::finished, this, [this](int result) {
    ScaleDialog* dialog = std::exchange(scale_dialog_, nullptr);
    for (ViewPane* pane : grid_->panes()) pane->canvas()->setPicking(false);
    if (result != QDialog::Accepted || !document_) return;
    auto changed = document_->WithScale(dialog->metresPerUnit());
    newJob(tr("Saving the scale"))
        ->start([changed](const Control&) { changed->SaveProject(); },
                [this, changed] {
                  document_ = changed;
                  grid_->updateDocument(changed);
                });
  });
  scale_dialog_->show();
}

void MainWindow::levelByTheGround() {
  // What runs already may be about to change the project; its dialog opens only after a moment.
  if (!document_ || !document_->project() || findChild<JobDialog*>()) return;
  // The points picked for a scale would be those of the frame before.
  if (scale_dialog_) scale_dialog_->reject();
  struct Levelling {
    Project project;
    LevelledGround levelled;
  };
  const auto levelling = std::make_shared<Levelling>();
  levelling->project = *document_->project();
  newJob(tr("Levelling by the ground"))
      ->start(
          [levelling](const Control& control) {
            levelling->levelled = LevelGround(&levelling->project, {}, control);
          },
          [this, levelling, up_before = document_->up()] {
            setDocument(Document::FromProject(levelling->project));
            showLevelled(levelling->levelled, up_before.has_value());
          });
}

void MainWindow::showLevelled(const LevelledGround& levelled, bool up_was_known) {
  const GroundPlane& ground = levelled.ground;
  const double turn = TurnOf(levelled.transform.rotation_and_translation);
  const bool turned = degrees(turn) >= kNoTurn;
  QStringList lines;
  lines << tr("The ground is z = 0 now, and z points up.");
  lines
      << (ground.by_normals
              ? tr("%1 of the points that face up lie within %2 of it, %3 in the root mean square.")
              : tr("%1 of the points lie within %2 of it, %3 in the root mean square."))
             .arg(formatShare(ground.share),
                  formatLength(ground.tolerance, document_->metres_per_unit()),
                  formatLength(ground.rms, document_->metres_per_unit()));
  // The turn is more than this where something else than z was up.
  if (up_was_known && std::abs(degrees(turn - levelled.tilt_rad)) >= kNoTurn) {
    lines << tr("Against what was up before, the ground was tilted by %1.")
                 .arg(formatDegrees(levelled.tilt_rad));
  }
  showMessage(
      this, tr("Levelling by the ground"),
      turned ? tr("The survey was turned by %1 to make its ground level.").arg(formatDegrees(turn))
             : tr("The ground was level already."),
      lines.join(QLatin1Char('\n')));
}

void MainWindow::askBuildLevels() {
  if (!document_ || !document_->project()) return;
  auto* dialog = new LevelsDialog(*document_->project(), this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  connect(dialog, &QDialog::accepted, this, [this, dialog] {
    const auto project = std::make_shared<Project>(*document_->project());
    // Levels that were finished before a failure or a cancel are there, so show them; one that was
    // built again has its files in another folder, and the old ones are gone.
    const auto take = [this, project] {
      const std::vector<LevelEntry>& before = document_->project()->levels();
      const std::vector<LevelEntry>& now = project->levels();
      if (!std::equal(
              before.begin(), before.end(), now.begin(), now.end(),
              [](const LevelEntry& a, const LevelEntry& b) { return a.folder == b.folder; })) {
        setDocument(Document::FromProject(*project));
      }
    };
    JobDialog* job = newJob(tr("Building levels"));
    connect(job->job(), &BackgroundJob::failed, this, take);
    connect(job->job(), &BackgroundJob::cancelled, this, take);
    job->start(
        [project, levels = dialog->levels(), options = dialog->options()](const Control& control) {
          BuildLevels(project.get(), levels, options, control);
        },
        [this, project] { setDocument(Document::FromProject(*project)); });
  });
  dialog->open();
}

}  // namespace sherd
