// One to four panes side by side and the link between their cameras.
#pragma once

#include <QWidget>
#include <functional>
#include <memory>
#include <vector>

#include "app/desktop/document.h"
#include "app/desktop/render_queue.h"
#include "app/desktop/view_pane.h"
#include "app/project/view.h"

class QGridLayout;

namespace sherd {

class BackgroundJob;

class ViewGrid : public QWidget {
  Q_OBJECT

 public:
  static constexpr int kMaxPanes = 4;
  enum class Arrangement { kAutomatic, kGrid, kRow };

  explicit ViewGrid(RendererFactory factory, QWidget* parent = nullptr);
  ~ViewGrid() override;

  RenderQueue* queue() { return &queue_; }
  // The panes on the screen, first to last.
  std::vector<ViewPane*> panes() const;
  ViewPane* activePane() const { return panes_[static_cast<std::size_t>(active_)].get(); }
  void setActivePane(ViewPane* pane);

  // Shows up to four levels, coarse to fine, all cameras linked and fitted. Null: closes.
  void setDocument(std::shared_ptr<Document> document);
  // The same levels with another scale.
  void updateDocument(std::shared_ptr<Document> document);
  const std::shared_ptr<Document>& document() const { return document_; }

  int paneCount() const { return count_; }
  void setPaneCount(int count);  // 1..4
  Arrangement arrangement() const { return arrangement_; }
  void setArrangement(Arrangement arrangement);
  const DisplaySettings& display() const { return display_; }
  void setDisplay(const DisplaySettings& display);
  void setAllLinked(bool linked);

  // Camera commands; they act on the active pane and those linked to it.
  void fit();
  void lookFrom(ViewPreset preset);
  void setProjection(Projection projection);
  // The horizontal angle in the active pane.
  void setFieldOfView(double fov_x_deg);
  void lookThrough(const Survey& survey, std::size_t photo_idx);
  void setPhotograph(const QImage& photo, const QString& name);
  void setPhotographOpacity(double opacity);

  // Calls `use` with the survey, at once where it is loaded, else when it is. Not at all where
  // there is none.
  void withSurvey(std::function<void(std::shared_ptr<const Survey>)> use);

 Q_SIGNALS:
  void activePaneChanged();
  void cameraChanged();
  void hovered(sherd::ViewPane* pane, std::optional<sherd::SurfaceHit> hit);
  void pointPicked(const sherd::SurfaceHit& hit);
  void failed(const QString& message);

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  void arrange();
  // Lets Fit see what a level that was loaded looks like.
  void learnShape(const ViewPane& pane);
  // Gives the camera of `source` to all panes linked with it and draws all of them.
  void shareCamera(ViewPane* source);

  RenderQueue queue_;
  std::vector<std::unique_ptr<ViewPane>> panes_;
  QGridLayout* layout_;
  int count_ = 1;
  int active_ = 0;
  Arrangement arrangement_ = Arrangement::kAutomatic;
  int columns_ = 0;
  bool shape_known_ = false;
  bool fitted_ = false;  // the camera still stands where Fit put it: fit again when sizes change
  DisplaySettings display_;
  std::shared_ptr<Document> document_;
  std::shared_ptr<const Survey> survey_;
  BackgroundJob* survey_job_ = nullptr;
  std::vector<std::function<void(std::shared_ptr<const Survey>)>> waiting_for_survey_;
};

}  // namespace sherd
