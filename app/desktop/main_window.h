// The window of sherd-desktop: opens and imports, holds the views, exports.
#pragma once

#include <QMainWindow>
#include <memory>
#include <optional>
#include <string>

#include "app/desktop/device_menu.h"
#include "app/desktop/document.h"
#include "app/desktop/export_dialog.h"
#include "app/desktop/import_dialog.h"
#include "app/desktop/render_queue.h"
#include "app/desktop/view_grid.h"
#include "cuda/device_query.h"

class QActionGroup;
class QDockWidget;
class QLabel;
class QStackedWidget;

namespace sherd {

class JobDialog;
class LightPanel;
class PhotographPanel;
class ScaleDialog;

class MainWindow : public QMainWindow {
  Q_OBJECT

 public:
  // `list_gpus`: what the choice of the device offers.
  explicit MainWindow(RendererFactory factory, GpuLister list_gpus = ListGpus,
                      QWidget* parent = nullptr);
  ~MainWindow() override;

  // Anything that can be dropped: a project, a cloud, a workspace. Ends in documentOpened, an
  // import dialog, or an error dialog.
  void openPath(const QString& path);
  // A point cloud or metaball file as it is, as a single level.
  void openCloud(const QString& path);
  // Imports and builds in the background, then opens the project.
  void startImport(const ImportPlan& plan);
  void exportScreenshot(const PictureExport& options);
  void exportSheet(const PictureExport& options, const std::vector<std::size_t>& levels);

  ViewGrid* grid() const { return grid_; }
  const std::shared_ptr<Document>& document() const { return document_; }
  // The files that were opened last, newest first.
  static QStringList recentPaths();

 public Q_SLOTS:
  void askOpen();
  void askOpenFolder();
  void askExportScreenshot();
  void askExportSheet();
  void askScale();
  void askBuildLevels();
  // Turns the project so that its ground is level, in the background, and shows it so.
  void levelByTheGround();
  void closeDocument();
  void showImportSummary();
  void showShortcuts();
  void showAbout();

 Q_SIGNALS:
  void documentOpened();
  void exportFinished(const QString& path);
  void problemShown(const QString& message);

 protected:
  void closeEvent(QCloseEvent* event) override;
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  // main_window_menus.cc
  void buildMenus();
  void buildFileMenu();
  void buildProjectMenu();
  void buildViewMenu();
  void buildPaneMenu();
  void buildHelpMenu();
  void fillRecentMenu();
  void updateActions();
  QAction* addAction(QMenu* menu, const QString& text, const QKeySequence& key,
                     std::function<void()> run);

  // main_window.cc
  void setDocument(std::shared_ptr<Document> document);
  void askImport(const Workspace& workspace);
  JobDialog* newJob(const QString& title);
  void showProblem(const QString& title, const QString& message);
  void remember(const QString& path);
  void updateDisplay();
  void choosePhotograph(std::size_t photo_idx);
  void stepPhotograph(int by);
  void showHover(ViewPane* pane, const std::optional<SurfaceHit>& hit);
  void showPhotographPanel(bool visible);
  void needSurvey();
  ExportScene exportScene() const;
  void showLevelled(const LevelledGround& levelled, bool up_was_known);
  void saveState();
  void restoreState();

  RendererFactory factory_;
  GpuLister list_gpus_;
  std::shared_ptr<Document> document_;
  QString device_why_;
  QString photo_wanted_;

  QStackedWidget* pages_;
  ViewGrid* grid_;
  LightPanel* light_;
  PhotographPanel* photographs_;
  QDockWidget* light_dock_;
  QDockWidget* photograph_dock_;
  QLabel* device_label_;
  QLabel* position_label_;
  ScaleDialog* scale_dialog_ = nullptr;
  BackgroundJob* photo_job_ = nullptr;

  QMenu* recent_menu_ = nullptr;
  DeviceMenu* device_menu_ = nullptr;
  QAction* perspective_ = nullptr;
  QAction* orthographic_ = nullptr;
  QAction* overlays_ = nullptr;
  QAction* smooth_ = nullptr;
  QAction* all_linked_ = nullptr;
  QActionGroup* layout_group_ = nullptr;
  QActionGroup* background_group_ = nullptr;
  QActionGroup* arrangement_group_ = nullptr;
  QList<QAction*> needs_document_, needs_project_, needs_photographs_;
};

}  // namespace sherd
