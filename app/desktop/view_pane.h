// One pane: a density level with its settings above, the picture, and its figures below.
#pragma once

#include <QFrame>
#include <memory>
#include <optional>

#include "app/desktop/camera_controller.h"
#include "app/desktop/document.h"
#include "app/desktop/render_queue.h"
#include "app/desktop/view_canvas.h"

class QBoxLayout;
class QComboBox;
class QSlider;
class QToolButton;

namespace sherd {

class BackgroundJob;
class InfoStrip;
class ValueSlider;

enum class PaneColors { kBlend, kPhotographs };

// What all panes share besides the camera.
struct DisplaySettings {
  Lighting lighting;
  QColor background;
  bool smooth_when_still = false;
  bool overlays = true;
};

class ViewPane : public QFrame {
  Q_OBJECT

 public:
  ViewPane(int number, RenderQueue* queue, QWidget* parent = nullptr);
  ~ViewPane() override;

  int queueId() const { return queue_id_; }
  ViewCanvas* canvas() const { return canvas_; }
  InfoStrip* strip() const { return strip_; }
  CameraController& camera() { return camera_; }

  // Null: nothing is open. level_idx into document->levels().
  void setDocument(std::shared_ptr<Document> document, std::size_t level_idx);
  // The same levels, other facts about them (the scale).
  void updateDocument(std::shared_ptr<Document> document);
  void setLevel(std::size_t level_idx);
  std::size_t levelIndex() const { return level_idx_; }
  // Null while it is loading.
  const std::shared_ptr<const Level>& level() const { return level_; }
  Surface surface() const;
  PaneColors colorSource() const;
  void setColorSource(PaneColors source);
  bool isLinked() const;
  void setLinked(bool linked);
  void setDisplay(const DisplaySettings& display);
  // The survey whose photographs give the colours; asked for by surveyNeeded.
  void setSurvey(std::shared_ptr<const Survey> survey);

  // Draws again with the present camera and settings.
  void refresh();
  // Shows what the renderer on this device is called in the strip.
  void setDevice(const QString& backend, const QString& device);

 Q_SIGNALS:
  void cameraMoved();
  void activated();
  void linkToggled(bool linked);
  void levelChanged();
  void levelLoaded();
  void surveyNeeded();
  void failed(const QString& message);
  // The picture on the screen is the final one.
  void settled();

 private:
  void buildHeader(int number);
  void loadLevel();
  void dropLoading();
  void showFigures();
  void takeView(const std::shared_ptr<const RenderedView>& view);

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  RenderQueue* queue_;
  int queue_id_;
  CameraController camera_;
  std::shared_ptr<Document> document_;
  std::size_t level_idx_ = 0;
  std::shared_ptr<const Level> level_;
  std::shared_ptr<const Survey> survey_;
  std::shared_ptr<const RenderedView> figures_;  // the last picture with one ray a pixel
  DisplaySettings display_;
  QString backend_, device_;
  BackgroundJob* loading_ = nullptr;

  QBoxLayout* header_layout_ = nullptr;
  QBoxLayout* value_layout_ = nullptr;
  QComboBox* level_box_ = nullptr;
  QComboBox* color_box_ = nullptr;
  ValueSlider* radius_ = nullptr;
  ValueSlider* threshold_ = nullptr;
  QToolButton* link_ = nullptr;
  ViewCanvas* canvas_ = nullptr;
  InfoStrip* strip_ = nullptr;
};

}  // namespace sherd
