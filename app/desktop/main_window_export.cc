// Exports, scale and further levels: the main window's work on an open document.
#include <QFileInfo>
#include <QStatusBar>
#include <algorithm>

#include "app/desktop/dialogs.h"
#include "app/desktop/export.h"
#include "app/desktop/main_window.h"
#include "app/desktop/scale_dialog.h"

namespace sherd {

ExportScene MainWindow::exportScene() const {
  ExportScene scene;
  scene.document = document_;
  const CameraController& camera = grid_->activePane()->camera();
  const QSize size = grid_->activePane()->canvas()->pixelSize();
  scene.camera = camera.MakeCamera(size.width(), size.height());
  scene.target_depth = camera.state().distance;
  scene.lighting = grid_->display().lighting;
  scene.backend = backend_;
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
