// Drives the real window with real mouse and key events; every test leaves a screenshot in
// test-output/desktop/ of the build folder.
#pragma once

#include <QTemporaryDir>
#include <QtTest>
#include <memory>

#include "app/desktop/main_window.h"

namespace sherd {

inline constexpr int kWait = 60000;  // ms

// The only visible widget of a type and name, or null.
template <class T>
T* shown(const QWidget* root, const QString& name = {}) {
  for (T* widget : root->findChildren<T*>(name)) {
    if (widget->isVisible()) return widget;
  }
  return nullptr;
}

class WindowTest : public QObject {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase();
  void init();
  void cleanup();

  void emptyWindow();
  void importByDialog();
  void fourLinkedPanes();
  void figuresTakeTheRoomTheyNeed();
  void opensABareCloud();
  void offersLevelsForAPointCloud();
  void opensWhatIsDropped();
  void switchesLevels();
  void orbitsPansAndZoomsByMouse();
  void doubleClickCentres();
  void breaksTheLink();
  void changesThresholdAndRadius();
  void presetAndProjectionKeys();
  void arrowKeysMove();
  void layoutKeys();
  void showsThePositionUnderTheCursor();
  void looksThroughPhotographs();
  void coloursFromPhotographs();
  void rakingLight();
  void setsTheScale();
  void exportsAScreenshot();
  void exportsTheSheet();
  void cancelsAnExport();
  void cancelsAnImport();
  void buildsMoreLevels();
  void keepsTheNoiseWhereAsked();
  void showsWhatWasBuiltBeforeACancel();
  void levelsByTheGround();
  void levelsNothingWithoutAGround();
  void cancelsALevelling();
  void badFilesEndInADialog();
  void unwritableExportEndsInADialog();
  void remembersWindowAndFiles();
  void choosesTheDevice();
  void saysThatTheSavedDeviceIsNotThere();
  void helpAndAbout();

 private:
  void open(const QString& path);
  void settle();  // every pane shows its final picture
  void keep(QWidget* widget, const QString& name);
  ViewPane* pane(int i) const { return window_->grid()->panes().at(static_cast<std::size_t>(i)); }
  QImage picture(int i) const {
    const auto& view = pane(i)->canvas()->view();
    return view ? view->image : QImage();
  }
  QPoint middle(int i) const { return pane(i)->canvas()->rect().center(); }
  void key(Qt::Key key, Qt::KeyboardModifiers modifiers = {}) {
    QTest::keyClick(pane(0)->canvas(), key, modifiers);
  }

  QTemporaryDir dir_;
  QString workspace_, project_;
  std::unique_ptr<MainWindow> window_;
};

// The share of pixels that differ; 1 for pictures of different sizes.
inline double changedShare(const QImage& a, const QImage& b) {
  if (a.size() != b.size()) return 1.0;
  qsizetype changed = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) changed += a.pixel(x, y) != b.pixel(x, y);
  }
  return static_cast<double>(changed) / (static_cast<double>(a.width()) * a.height());
}

}  // namespace sherd
