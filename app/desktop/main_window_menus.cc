// The menus of the main window, their keys and what depends on the present state.
#include <QAction>
#include <QActionGroup>
#include <QApplication>
#include <QDockWidget>
#include <QFileInfo>
#include <QKeyEvent>
#include <QMenu>
#include <QMenuBar>

#include "app/desktop/help_dialogs.h"
#include "app/desktop/main_window.h"
#include "app/desktop/side_panels.h"
#include "app/desktop/theme.h"

namespace sherd {

QAction* MainWindow::addAction(QMenu* menu, const QString& text, const QKeySequence& key,
                               std::function<void()> run) {
  QAction* action = menu->addAction(text);
  if (!key.isEmpty()) action->setShortcut(key);
  if (run) connect(action, &QAction::triggered, this, [run] { run(); });
  return action;
}

void MainWindow::buildMenus() {
  buildFileMenu();
  buildProjectMenu();
  buildViewMenu();
  buildPaneMenu();
  buildHelpMenu();
}

void MainWindow::buildFileMenu() {
  QMenu* menu = menuBar()->addMenu(tr("&File"));
  addAction(menu, tr("&Open …"), QKeySequence::Open, [this] { askOpen(); });
  addAction(menu, tr("Open &folder …"), Qt::CTRL | Qt::SHIFT | Qt::Key_O,
            [this] { askOpenFolder(); });
  recent_menu_ = menu->addMenu(tr("Open &recent"));
  connect(recent_menu_, &QMenu::aboutToShow, this, &MainWindow::fillRecentMenu);
  needs_document_ << addAction(menu, tr("&Close"), QKeySequence::Close,
                               [this] { closeDocument(); });
  menu->addSeparator();
  needs_document_ << addAction(menu, tr("Export &screenshot …"), Qt::CTRL | Qt::Key_E,
                               [this] { askExportScreenshot(); });
  needs_document_ << addAction(menu, tr("Export &comparison sheet …"),
                               Qt::CTRL | Qt::SHIFT | Qt::Key_E, [this] { askExportSheet(); });
  menu->addSeparator();
  addAction(menu, tr("&Quit"), Qt::CTRL | Qt::Key_Q, [this] { close(); });
}

void MainWindow::fillRecentMenu() {
  recent_menu_->clear();
  const QStringList paths = recentPaths();
  for (const QString& path : paths) {
    addAction(recent_menu_, path, {}, [this, path] { openPath(path); });
  }
  if (paths.isEmpty()) recent_menu_->addAction(tr("none"))->setEnabled(false);
}

void MainWindow::buildProjectMenu() {
  QMenu* menu = menuBar()->addMenu(tr("&Project"));
  needs_project_ << addAction(menu, tr("&Build levels …"), Qt::CTRL | Qt::Key_B,
                              [this] { askBuildLevels(); });
  needs_document_ << addAction(menu, tr("Set &scale …"), Qt::CTRL | Qt::Key_M,
                               [this] { askScale(); });
  needs_project_ << addAction(menu, tr("Level by the &ground"), Qt::CTRL | Qt::Key_G,
                              [this] { levelByTheGround(); });
  needs_project_ << addAction(menu, tr("&Import summary"), Qt::CTRL | Qt::Key_I,
                              [this] { showImportSummary(); });
}

void MainWindow::buildViewMenu() {
  QMenu* menu = menuBar()->addMenu(tr("&View"));
  const struct {
    QString text;
    ViewPreset preset;
  } presets[] = {{tr("&Front"), ViewPreset::kFront},  {tr("&Back"), ViewPreset::kBack},
                 {tr("&Left"), ViewPreset::kLeft},    {tr("&Right"), ViewPreset::kRight},
                 {tr("&Top"), ViewPreset::kTop},      {tr("B&ottom"), ViewPreset::kBottom},
                 {tr("&Isometric"), ViewPreset::kIso}};
  int number = 1;
  for (const auto& entry : presets) {
    needs_document_ << addAction(menu, entry.text, QKeySequence(Qt::Key_0 + number++),
                                 [this, preset = entry.preset] { grid_->lookFrom(preset); });
  }
  menu->addSeparator();
  QAction* fit = addAction(menu, tr("Fit &all"), {}, [this] { grid_->fit(); });
  fit->setShortcuts({QKeySequence(Qt::Key_F), QKeySequence(Qt::Key_Home)});
  needs_document_ << fit;
  auto* projections = new QActionGroup(this);
  perspective_ = addAction(menu, tr("&Perspective"), Qt::Key_P,
                           [this] { grid_->setProjection(Projection::kPerspective); });
  orthographic_ = addAction(menu, tr("Ortho&graphic"), Qt::Key_O,
                            [this] { grid_->setProjection(Projection::kOrthographic); });
  for (QAction* action : {perspective_, orthographic_}) {
    action->setCheckable(true);
    projections->addAction(action);
    needs_document_ << action;
  }
  perspective_->setChecked(true);
  menu->addSeparator();
  QAction* photographs = photograph_dock_->toggleViewAction();
  photographs->setText(tr("P&hotographs"));
  photographs->setShortcut(Qt::CTRL | Qt::Key_P);
  menu->addAction(photographs);
  needs_photographs_ << addAction(menu, tr("&Next photograph"), Qt::Key_PageDown,
                                  [this] { stepPhotograph(1); });
  needs_photographs_ << addAction(menu, tr("Photograph b&efore"), Qt::Key_PageUp,
                                  [this] { stepPhotograph(-1); });
  QAction* light = light_dock_->toggleViewAction();
  light->setText(tr("Light an&d lens"));
  light->setShortcut(Qt::CTRL | Qt::Key_L);
  menu->addAction(light);
  menu->addSeparator();

  QMenu* background = menu->addMenu(tr("Bac&kground"));
  background_group_ = new QActionGroup(this);
  const struct {
    QString text;
    QColor color;
  } colors[] = {{tr("Dark grey"), theme::kCanvas},
                {tr("Black"), QColor(0, 0, 0)},
                {tr("Light grey"), QColor(208, 209, 211)},
                {tr("White"), QColor(255, 255, 255)}};
  for (const auto& entry : colors) {
    QAction* action = addAction(background, entry.text, {}, [this] { updateDisplay(); });
    action->setCheckable(true);
    action->setData(entry.color);
    background_group_->addAction(action);
  }
  background_group_->actions().first()->setChecked(true);
  overlays_ = addAction(menu, tr("Scale bar and a&xes"), Qt::Key_A, [this] { updateDisplay(); });
  overlays_->setCheckable(true);
  overlays_->setChecked(true);
  smooth_ = addAction(menu, tr("S&mooth edges when still"), Qt::Key_S, [this] { updateDisplay(); });
  smooth_->setCheckable(true);
  device_menu_ = new DeviceMenu(list_gpus_, menu);
  menu->addMenu(device_menu_);
  connect(device_menu_, &DeviceMenu::chosen, grid_->queue(), &RenderQueue::setDevice);
  grid_->queue()->setDevice(device_menu_->choice());
  menu->addSeparator();
  QAction* full = addAction(menu, tr("F&ull screen"), Qt::Key_F11, {});
  full->setCheckable(true);
  connect(full, &QAction::toggled, this, [this](bool on) { on ? showFullScreen() : showNormal(); });
}

void MainWindow::buildPaneMenu() {
  QMenu* menu = menuBar()->addMenu(tr("Pa&nes"));
  layout_group_ = new QActionGroup(this);
  const QString counts[] = {tr("&One pane"), tr("&Two panes"), tr("T&hree panes"),
                            tr("&Four panes")};
  for (int count = 1; count <= ViewGrid::kMaxPanes; ++count) {
    QAction* action =
        addAction(menu, counts[count - 1], QKeySequence(Qt::CTRL | (Qt::Key_0 + count)),
                  [this, count] { grid_->setPaneCount(count); });
    action->setCheckable(true);
    layout_group_->addAction(action);
    needs_document_ << action;
  }
  QMenu* arrangement = menu->addMenu(tr("&Arrange"));
  arrangement_group_ = new QActionGroup(this);
  const struct {
    QString text;
    ViewGrid::Arrangement arrangement;
  } arrangements[] = {{tr("As the window's shape asks for"), ViewGrid::Arrangement::kAutomatic},
                      {tr("In two rows"), ViewGrid::Arrangement::kGrid},
                      {tr("In one row"), ViewGrid::Arrangement::kRow}};
  for (const auto& entry : arrangements) {
    QAction* action = addAction(arrangement, entry.text, {},
                                [this, a = entry.arrangement] { grid_->setArrangement(a); });
    action->setCheckable(true);
    arrangement_group_->addAction(action);
  }
  arrangement_group_->actions().first()->setChecked(true);
  menu->addSeparator();
  const auto pane = [this] { return grid_->activePane(); };
  needs_document_ << addAction(menu, tr("&Coarser level"), Qt::Key_BracketLeft, [pane] {
    if (pane()->levelIndex() > 0) pane()->setLevel(pane()->levelIndex() - 1);
  });
  needs_document_ << addAction(menu, tr("F&iner level"), Qt::Key_BracketRight,
                               [pane] { pane()->setLevel(pane()->levelIndex() + 1); });
  needs_photographs_ << addAction(menu, tr("&Blended colours or photographs"), Qt::Key_C, [pane] {
    pane()->setColorSource(pane()->colorSource() == PaneColors::kBlend ? PaneColors::kPhotographs
                                                                       : PaneColors::kBlend);
  });
  needs_document_ << addAction(menu, tr("&Link this camera"), Qt::Key_L,
                               [pane] { pane()->setLinked(!pane()->isLinked()); });
  all_linked_ = addAction(menu, tr("Link a&ll cameras"), Qt::SHIFT | Qt::Key_L, {});
  connect(all_linked_, &QAction::triggered, this, [this] {
    const auto panes = grid_->panes();
    const bool all =
        std::all_of(panes.begin(), panes.end(), [](const ViewPane* p) { return p->isLinked(); });
    grid_->setAllLinked(!all);
  });
  needs_document_ << all_linked_;
  menu->addSeparator();
  const auto move_focus = [this](int by) {
    const auto panes = grid_->panes();
    const auto at = std::find(panes.begin(), panes.end(), grid_->activePane()) - panes.begin();
    const auto count = static_cast<std::ptrdiff_t>(panes.size());
    ViewPane* next = panes[static_cast<std::size_t>((at + by + count) % count)];
    grid_->setActivePane(next);
    next->canvas()->setFocus(Qt::ShortcutFocusReason);
  };
  needs_document_ << addAction(menu, tr("&Next pane"), Qt::Key_F6, [=] { move_focus(1); });
  needs_document_ << addAction(menu, tr("Pane bef&ore"), Qt::SHIFT | Qt::Key_F6,
                               [=] { move_focus(-1); });
}

void MainWindow::buildHelpMenu() {
  QMenu* menu = menuBar()->addMenu(tr("&Help"));
  QAction* keys = addAction(menu, tr("&Keys and mouse"), {}, [this] { showShortcuts(); });
  keys->setShortcuts({QKeySequence(Qt::Key_F1), QKeySequence(Qt::Key_H)});
  addAction(menu, tr("&About Sherd"), {}, [this] { showAbout(); });
}

void MainWindow::updateActions() {
  const bool open = document_ && !document_->levels().empty();
  for (QAction* action : needs_document_) action->setEnabled(open);
  for (QAction* action : needs_project_) {
    action->setEnabled(document_ && document_->project() != nullptr);
  }
  for (QAction* action : needs_photographs_) {
    action->setEnabled(open && document_->HasPhotographs());
  }
  const bool orthographic =
      grid_->activePane()->camera().state().projection == Projection::kOrthographic;
  (orthographic ? orthographic_ : perspective_)->setChecked(true);
  layout_group_->actions().at(grid_->paneCount() - 1)->setChecked(true);
}

void MainWindow::showShortcuts() {
  auto* dialog = new ShortcutsDialog(menuBar(), this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->open();
}

void MainWindow::showAbout() {
  auto* dialog = new AboutDialog(device_why_, this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->open();
}

void MainWindow::keyPressEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Escape && isFullScreen()) {
    for (QAction* action : findChildren<QAction*>()) {
      if (action->shortcut() == QKeySequence(Qt::Key_F11)) action->setChecked(false);
    }
    return;
  }
  QMainWindow::keyPressEvent(event);
}

}  // namespace sherd
