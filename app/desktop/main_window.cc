#include "app/desktop/main_window.h"

#include <QAction>
#include <QActionGroup>
#include <QApplication>
#include <QCloseEvent>
#include <QDir>
#include <QDockWidget>
#include <QDragEnterEvent>
#include <QFileDialog>
#include <QFileInfo>
#include <QLabel>
#include <QMenu>
#include <QMimeData>
#include <QSettings>
#include <QStackedWidget>
#include <QStatusBar>
#include <utility>

#include "app/desktop/background_job.h"
#include "app/desktop/dialogs.h"
#include "app/desktop/formatting.h"
#include "app/desktop/scale_dialog.h"
#include "app/desktop/side_panels.h"
#include "app/desktop/theme.h"
#include "app/desktop/welcome_page.h"
#include "metaball/progress_range.h"
#include "reconstruction/mesh_import.h"

namespace sherd {
namespace {

constexpr int kRecent = 10;
// A photograph over a view is never larger than a screen.
constexpr int kPhotoSide = 2048;

QString nativePath(const std::string& path) {
  return QDir::toNativeSeparators(QString::fromStdString(path));
}

}  // namespace

MainWindow::MainWindow(RendererFactory factory, GpuLister list_gpus, QWidget* parent)
    : QMainWindow(parent), factory_(std::move(factory)), list_gpus_(std::move(list_gpus)) {
  setObjectName(QStringLiteral("mainWindow"));
  setAcceptDrops(true);
  pages_ = new QStackedWidget(this);
  auto* welcome = new WelcomePage(this);
  grid_ = new ViewGrid(factory_, this);
  pages_->addWidget(welcome);
  pages_->addWidget(grid_);
  setCentralWidget(pages_);
  connect(welcome, &WelcomePage::openFileWanted, this, &MainWindow::askOpen);
  connect(welcome, &WelcomePage::openFolderWanted, this, &MainWindow::askOpenFolder);
  connect(welcome, &WelcomePage::openWanted, this, &MainWindow::openPath);
  welcome->setRecent(recentPaths());

  photographs_ = new PhotographPanel(this);
  photograph_dock_ = new QDockWidget(tr("Photographs"), this);
  photograph_dock_->setObjectName(QStringLiteral("photographDock"));
  photograph_dock_->setWidget(photographs_);
  addDockWidget(Qt::LeftDockWidgetArea, photograph_dock_);
  photograph_dock_->hide();
  light_ = new LightPanel(this);
  light_dock_ = new QDockWidget(tr("Light and lens"), this);
  light_dock_->setObjectName(QStringLiteral("lightDock"));
  light_dock_->setWidget(light_);
  addDockWidget(Qt::LeftDockWidgetArea, light_dock_);
  light_dock_->hide();

  device_label_ = new QLabel(this);
  device_label_->setObjectName(QStringLiteral("device"));
  device_label_->setAccessibleName(tr("Rendering device"));
  device_label_->setMinimumWidth(1);  // a long reason must not widen the window
  position_label_ = new QLabel(this);
  position_label_->setObjectName(QStringLiteral("position"));
  position_label_->setAccessibleName(tr("Position under the cursor"));
  statusBar()->addWidget(position_label_, 1);
  statusBar()->addPermanentWidget(device_label_);

  connect(grid_->queue(), &RenderQueue::deviceChosen, this,
          [this](const QString& backend, const QString& device, const QString& why) {
            device_why_ = why.isEmpty() ? backend.toUpper() + QStringLiteral(": ") + device : why;
            device_label_->setText(device_why_);
            device_label_->setToolTip(device_why_);
          });
  connect(grid_, &ViewGrid::hovered, this, &MainWindow::showHover);
  connect(grid_, &ViewGrid::failed, this,
          [this](const QString& message) { showProblem(tr("This cannot be shown"), message); });
  connect(grid_, &ViewGrid::activePaneChanged, this, &MainWindow::updateActions);
  connect(grid_, &ViewGrid::cameraChanged, this, &MainWindow::updateActions);
  connect(light_, &LightPanel::lightingChanged, this, &MainWindow::updateDisplay);
  connect(light_, &LightPanel::fieldOfViewChanged, grid_, &ViewGrid::setFieldOfView);
  connect(photographs_, &PhotographPanel::photographChosen, this, &MainWindow::choosePhotograph);
  connect(photographs_, &PhotographPanel::opacityChanged, grid_, &ViewGrid::setPhotographOpacity);
  connect(photograph_dock_, &QDockWidget::visibilityChanged, this, [this](bool visible) {
    if (visible) needSurvey();
  });

  buildMenus();
  restoreState();
  updateDisplay();
  setDocument(nullptr);
}

MainWindow::~MainWindow() {
  // The views ask this window about devices and documents until they are gone.
  delete grid_;
}

QStringList MainWindow::recentPaths() {
  return QSettings().value(QStringLiteral("recent")).toStringList();
}

void MainWindow::remember(const QString& path) {
  QStringList paths = recentPaths();
  paths.removeAll(path);
  paths.prepend(path);
  while (paths.size() > kRecent) paths.removeLast();
  QSettings().setValue(QStringLiteral("recent"), paths);
  if (auto* welcome = findChild<WelcomePage*>()) welcome->setRecent(paths);
}

JobDialog* MainWindow::newJob(const QString& title) {
  auto* dialog = new JobDialog(title, this);
  connect(dialog->job(), &BackgroundJob::failed, this,
          [this, title](const QString& message) { showProblem(title, message); });
  connect(dialog->job(), &BackgroundJob::cancelled, this,
          [this, title] { statusBar()->showMessage(tr("%1: cancelled").arg(title), 8000); });
  return dialog;
}

void MainWindow::showProblem(const QString& title, const QString& message) {
  showError(this, title, message);
  Q_EMIT problemShown(message);
}

void MainWindow::openPath(const QString& path) {
  struct Found {
    std::shared_ptr<Document> document;
    std::optional<Workspace> workspace;
  };
  const auto found = std::make_shared<Found>();
  const std::string name = QDir::cleanPath(QFileInfo(path).absoluteFilePath()).toStdString();
  JobDialog* dialog = newJob(tr("Opening %1").arg(QFileInfo(path).fileName()));
  dialog->start(
      [name, found](const Control& control) {
        switch (ClassifyPath(name)) {
          case PathKind::kProject:
            found->document = Document::OpenProject(name);
            break;
          case PathKind::kCloud:
            found->document = Document::OpenCloud(name, control);
            break;
          case PathKind::kWorkspace:
            found->workspace = InspectWorkspace(name);
            break;
        }
      },
      [this, found] {
        if (found->document) {
          setDocument(found->document);
        } else {
          askImport(*found->workspace);
        }
      });
}

void MainWindow::openCloud(const QString& path) {
  const auto document = std::make_shared<std::shared_ptr<Document>>();
  JobDialog* dialog = newJob(tr("Opening %1").arg(QFileInfo(path).fileName()));
  dialog->start([name = path.toStdString(), document](
                    const Control& control) { *document = Document::OpenCloud(name, control); },
                [this, document] { setDocument(*document); });
}

void MainWindow::setDocument(std::shared_ptr<Document> document) {
  document_ = std::move(document);
  photographs_->setSurvey(nullptr);
  position_label_->clear();
  if (scale_dialog_) scale_dialog_->reject();
  pages_->setCurrentIndex(document_ ? 1 : 0);
  if (document_) {
    const PresetAxes axes = AxesFor(document_->up(), document_->front());
    light_->setAxes(axes.east, axes.north, axes.up);
    remember(QString::fromStdString(document_->path()));
  }
  grid_->setDocument(document_);
  updateDisplay();
  if (document_) {
    setWindowTitle(tr("%1 – Sherd").arg(QString::fromStdString(document_->title())));
    setWindowFilePath(QString::fromStdString(document_->path()));
    grid_->activePane()->canvas()->setFocus();
    if (photograph_dock_->isVisible()) needSurvey();
  } else {
    setWindowTitle(tr("Sherd"));
  }
  updateActions();
  if (document_) Q_EMIT documentOpened();
}

void MainWindow::closeDocument() { setDocument(nullptr); }

void MainWindow::askOpen() {
  const QString folder = QSettings().value(QStringLiteral("openFolder")).toString();
  QString meshes;
  for (const char* extension : kMeshExtensions) {
    meshes += QStringLiteral(" *") + QLatin1String(extension);
  }
  const QString path = QFileDialog::getOpenFileName(
      this, tr("Open"), folder,
      tr("All that Sherd reads (*.sherd *.metaballs *.ply *.bin *.txt%1);;Projects (*.sherd);;"
         "Clouds (*.metaballs *.ply);;Meshes (*.ply%1);;All files (*)")
          .arg(meshes));
  if (path.isEmpty()) return;
  QSettings().setValue(QStringLiteral("openFolder"), QFileInfo(path).path());
  openPath(path);
}

void MainWindow::askOpenFolder() {
  const QString folder = QSettings().value(QStringLiteral("openFolder")).toString();
  const QString path = QFileDialog::getExistingDirectory(this, tr("Open a workspace"), folder);
  if (path.isEmpty()) return;
  QSettings().setValue(QStringLiteral("openFolder"), QFileInfo(path).path());
  openPath(path);
}

void MainWindow::askImport(const Workspace& workspace) {
  auto* dialog = new ImportDialog(workspace, this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowModality(Qt::WindowModal);
  connect(dialog, &QDialog::accepted, this, [this, dialog] { startImport(dialog->plan()); });
  connect(dialog, &ImportDialog::showAsItIsWanted, this, &MainWindow::openCloud);
  dialog->open();
}

void MainWindow::startImport(const ImportPlan& plan) {
  // The project as far as it came: an import that is there stays there when the levels fail.
  const auto project = std::make_shared<std::optional<Project>>();
  JobDialog* dialog = newJob(tr("Importing"));
  const auto keep = [this, project] {
    if (*project) setDocument(Document::FromProject(**project));
  };
  connect(dialog->job(), &BackgroundJob::failed, this, keep);
  connect(dialog->job(), &BackgroundJob::cancelled, this, keep);
  dialog->start(
      [plan, project](const Control& control) {
        Project imported = ImportSurvey(plan.options, plan.project_path, PartOf(control, 0.0, 0.4));
        *project = imported;
        try {
          BuildLevels(&imported, plan.levels, plan.level_options, PartOf(control, 0.4, 1.0));
        } catch (...) {
          *project = imported;  // with the levels that were finished
          throw;
        }
        *project = imported;
      },
      [this, project] {
        setDocument(Document::FromProject(**project));
        showImportSummary();
      });
}

void MainWindow::showImportSummary() {
  if (!document_ || !document_->project()) return;
  const ImportSummary& s = document_->project()->import_summary();
  QStringList lines;
  lines << tr("%1 points (%2) and %3 photographs from %4 cameras, in %5.")
               .arg(formatInteger(s.points), s.dense ? tr("dense cloud") : tr("sparse points"),
                    formatInteger(s.photographs), formatInteger(s.cameras),
                    formatSeconds(s.seconds));
  if (s.photographs > 0) {
    lines << (s.photographs_found == s.photographs
                  ? tr("All photographs were found.")
                  : tr("%1 of %2 photographs were found.")
                        .arg(formatInteger(s.photographs_found), formatInteger(s.photographs)));
  }
  for (const LevelEntry& level : document_->levels()) {
    QString line = tr("Level %1: %2 metaballs, noise %3, spacing %4")
                       .arg(QString::fromStdString(level.name), formatInteger(level.stats.count),
                            QString::fromStdString(NoiseName(level)),
                            formatLength(level.stats.spacing, document_->metres_per_unit()));
    if (level.stats.HasErrors()) {
      line += tr(", %1 from the points in the mean")
                  .arg(formatLength(level.stats.error_mean, document_->metres_per_unit()));
    }
    if (level.stats.closing_points > 0) {
      line += tr("; %1 points were added to close holes")
                  .arg(formatInteger(level.stats.closing_points));
    }
    if (level.stats.open_share > 0) {
      line += tr("; holes possible around %1 of them").arg(formatShare(level.stats.open_share));
    }
    lines << line + QLatin1Char('.');
  }
  QStringList warnings;
  for (const std::string& warning : s.warnings) warnings << QString::fromStdString(warning);
  const QString details =
      lines.join(QLatin1Char('\n')) +
      (warnings.isEmpty() ? QString()
                          : tr("\n\nTo note:\n• ") + warnings.join(QStringLiteral("\n• ")));
  showMessage(this, tr("Import"), tr("Imported from %1").arg(nativePath(s.source)), details);
}

void MainWindow::updateDisplay() {
  DisplaySettings display = grid_->display();
  display.lighting = light_->lighting();
  display.overlays = overlays_->isChecked();
  display.smooth_when_still = smooth_->isChecked();
  if (const QAction* action = background_group_->checkedAction()) {
    display.background = action->data().value<QColor>();
  }
  grid_->setDisplay(display);
}

void MainWindow::needSurvey() {
  if (!document_ || !document_->HasPhotographs() || photographs_->survey()) return;
  grid_->withSurvey(
      [this](std::shared_ptr<const Survey> survey) { photographs_->setSurvey(std::move(survey)); });
}

void MainWindow::stepPhotograph(int by) {
  if (!document_ || !document_->HasPhotographs()) return;
  grid_->withSurvey([this, by](std::shared_ptr<const Survey> survey) {
    if (!photographs_->survey()) photographs_->setSurvey(std::move(survey));
    photographs_->step(by);
  });
}

void MainWindow::choosePhotograph(std::size_t photo_idx) {
  const std::shared_ptr<const Survey> survey = photographs_->survey();
  if (!survey || photo_idx >= survey->photographs.size()) return;
  const Photograph& photograph = survey->photographs[photo_idx];
  const QString name = QString::fromStdString(photograph.name);
  grid_->lookThrough(*survey, photo_idx);
  grid_->setPhotograph({}, name);
  updateActions();
  photo_wanted_ = name;
  if (photograph.path.empty()) return;
  // The picture itself follows when it is read; a later choice makes an earlier one void.
  auto* job = new BackgroundJob(this);
  const auto image = std::make_shared<QImage>();
  connect(job, &BackgroundJob::succeeded, this, [this, job, image, name] {
    job->deleteLater();
    if (photo_wanted_ == name) grid_->setPhotograph(*image, name);
  });
  connect(job, &BackgroundJob::failed, this, [this, job](const QString& message) {
    job->deleteLater();
    statusBar()->showMessage(message, 10000);
  });
  job->start(
      [path = photograph.path, image](const Control&) {
        const PhotoImage photo = ReadPhoto(path, kPhotoSide);
        QImage picture(photo.width, photo.height, QImage::Format_RGB32);
        for (int y = 0; y < photo.height; ++y) {
          auto* line = reinterpret_cast<QRgb*>(picture.scanLine(y));
          const Rgb8* row = photo.pixels.data() + static_cast<std::size_t>(y) * photo.width;
          for (int x = 0; x < photo.width; ++x) line[x] = qRgb(row[x].r, row[x].g, row[x].b);
        }
        *image = std::move(picture);
      },
      {});
}

void MainWindow::showHover(ViewPane* pane, const std::optional<SurfaceHit>& hit) {
  if (!hit || !document_) {
    position_label_->clear();
    return;
  }
  const Camera camera = pane->camera().MakeCamera(pane->canvas()->pixelSize().width(),
                                                  pane->canvas()->pixelSize().height());
  const double resolution = camera.PixelSizeAt(hit->distance);
  QString text = tr("X %1   Y %2   Z %3")
                     .arg(formatCoordinate(hit->point.x, resolution),
                          formatCoordinate(hit->point.y, resolution),
                          formatCoordinate(hit->point.z, resolution));
  if (hit->id >= 0) text += tr("   metaball %1").arg(hit->id);
  if (camera.projection == Projection::kPerspective) {
    text += tr("   distance %1").arg(formatLength(hit->distance, document_->metres_per_unit()));
  }
  position_label_->setText(text);
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event) {
  const QList<QUrl> urls = event->mimeData()->urls();
  if (!urls.isEmpty() && urls.first().isLocalFile()) event->acceptProposedAction();
}

void MainWindow::dropEvent(QDropEvent* event) {
  const QList<QUrl> urls = event->mimeData()->urls();
  if (urls.isEmpty()) return;
  event->acceptProposedAction();
  const QString path = urls.first().toLocalFile();
  // Not inside the drop: the program that drags waits for its end.
  QMetaObject::invokeMethod(
      this, [this, path] { openPath(path); }, Qt::QueuedConnection);
}

void MainWindow::closeEvent(QCloseEvent* event) {
  saveState();
  event->accept();
}

void MainWindow::saveState() {
  QSettings settings;
  settings.setValue(QStringLiteral("geometry"), saveGeometry());
  settings.setValue(QStringLiteral("windowState"), QMainWindow::saveState());
  settings.setValue(QStringLiteral("overlays"), overlays_->isChecked());
  settings.setValue(QStringLiteral("smooth"), smooth_->isChecked());
  settings.setValue(QStringLiteral("background"),
                    background_group_->actions().indexOf(background_group_->checkedAction()));
  settings.setValue(QStringLiteral("arrangement"),
                    arrangement_group_->actions().indexOf(arrangement_group_->checkedAction()));
}

void MainWindow::restoreState() {
  const QSettings settings;
  if (!restoreGeometry(settings.value(QStringLiteral("geometry")).toByteArray())) resize(1400, 900);
  QMainWindow::restoreState(settings.value(QStringLiteral("windowState")).toByteArray());
  overlays_->setChecked(settings.value(QStringLiteral("overlays"), true).toBool());
  smooth_->setChecked(settings.value(QStringLiteral("smooth"), true).toBool());
  const auto restore = [&](QActionGroup* group, const QString& key) {
    const int index = settings.value(key, 0).toInt();
    if (index >= 0 && index < group->actions().size()) group->actions().at(index)->trigger();
  };
  restore(background_group_, QStringLiteral("background"));
  restore(arrangement_group_, QStringLiteral("arrangement"));
}

}  // namespace sherd
