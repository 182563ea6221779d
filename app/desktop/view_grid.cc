#include "app/desktop/view_grid.h"

#include <QGridLayout>
#include <QResizeEvent>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/desktop/background_job.h"
#include "app/desktop/theme.h"
#include "app/project/settings.h"

namespace sherd {
namespace {

constexpr std::size_t kShapePoints = 4000;

}  // namespace

ViewGrid::ViewGrid(RendererFactory factory, QWidget* parent)
    : QWidget(parent), queue_(std::move(factory)), layout_(new QGridLayout(this)) {
  layout_->setContentsMargins(0, 0, 0, 0);
  layout_->setSpacing(2);
  setObjectName(QStringLiteral("viewGrid"));
  display_.background = theme::kCanvas;
  for (int i = 0; i < kMaxPanes; ++i) {
    auto pane = std::make_unique<ViewPane>(i + 1, &queue_, this);
    ViewPane* p = pane.get();
    p->setDisplay(display_);
    p->hide();
    connect(p, &ViewPane::cameraMoved, this, [this, p] {
      fitted_ = false;
      shareCamera(p);
    });
    connect(p->canvas(), &ViewCanvas::resized, this, [this, p] {
      if (fitted_ && p == activePane()) fit();
    });
    connect(p, &ViewPane::activated, this, [this, p] { setActivePane(p); });
    connect(p, &ViewPane::failed, this, &ViewGrid::failed);
    connect(p, &ViewPane::levelLoaded, this, [this, p] { learnShape(*p); });
    connect(p, &ViewPane::linkToggled, this, [this, p](bool linked) {
      if (!linked) return;
      // Joining: take the view of those that are linked already.
      for (ViewPane* other : panes()) {
        if (other == p || !other->isLinked()) continue;
        p->camera().SetState(other->camera().state());
        p->refresh();
        break;
      }
    });
    connect(p, &ViewPane::surveyNeeded, this, [this, p] {
      withSurvey([p](std::shared_ptr<const Survey> survey) { p->setSurvey(std::move(survey)); });
    });
    connect(p->canvas(), &ViewCanvas::hovered, this,
            [this, p](const std::optional<SurfaceHit>& hit) {
              for (ViewPane* other : panes()) {
                const bool show = other != p && hit && other->isLinked() && p->isLinked();
                other->canvas()->setMark(show ? std::optional(hit->point) : std::nullopt);
              }
              Q_EMIT hovered(p, hit);
            });
    connect(p->canvas(), &ViewCanvas::pointPicked, this, &ViewGrid::pointPicked);
    panes_.push_back(std::move(pane));
  }
  connect(&queue_, &RenderQueue::deviceChosen, this,
          [this](const QString& backend, const QString& device) {
            for (const auto& pane : panes_) pane->setDevice(backend, device);
          });
  arrange();
}

ViewGrid::~ViewGrid() {
  panes_.clear();  // before the queue they are registered with
}

std::vector<ViewPane*> ViewGrid::panes() const {
  std::vector<ViewPane*> shown;
  for (int i = 0; i < count_; ++i) shown.push_back(panes_[static_cast<std::size_t>(i)].get());
  return shown;
}

void ViewGrid::setActivePane(ViewPane* pane) {
  for (int i = 0; i < count_; ++i) {
    if (panes_[static_cast<std::size_t>(i)].get() != pane || active_ == i) continue;
    active_ = i;
    queue_.setActivePane(pane->queueId());
    Q_EMIT activePaneChanged();
  }
}

void ViewGrid::setDocument(std::shared_ptr<Document> document) {
  document_ = std::move(document);
  shape_known_ = false;
  survey_.reset();
  waiting_for_survey_.clear();
  if (survey_job_) {
    delete survey_job_;
    survey_job_ = nullptr;
  }
  const std::size_t levels = document_ ? document_->levels().size() : 0;
  if (document_) {
    const int wanted = std::clamp(static_cast<int>(levels), 1, kMaxPanes);
    if (wanted != count_) setPaneCount(wanted);
  }
  for (std::size_t i = 0; i < panes_.size(); ++i) {
    ViewPane& pane = *panes_[i];
    if (document_) {
      pane.setLinked(true);
      pane.camera().SetShape(nullptr);
      pane.camera().SetScene(document_->bounds(), AxesFor(document_->up(), {}).up);
    }
    // More levels than panes: the finest ones, which one has built last.
    const std::size_t first = levels > kMaxPanes ? levels - kMaxPanes : 0;
    pane.setDocument(document_, levels == 0 ? 0 : std::min(first + i, levels - 1));
  }
  if (document_) {
    active_ = 0;
    queue_.setActivePane(activePane()->queueId());
    for (const auto& pane : panes_) pane->camera().SetState(CameraState());
    setFieldOfView(Setting("fov-x").fallback);
    lookFrom(ViewPreset::kIso);
    Q_EMIT activePaneChanged();
  }
}

void ViewGrid::learnShape(const ViewPane& pane) {
  if (shape_known_ || !pane.level()) return;
  shape_known_ = true;
  const Cloud& cloud = pane.level()->cloud;
  const std::size_t step = std::max<std::size_t>(1, cloud.size() / kShapePoints);
  auto points = std::make_shared<std::vector<Vec3d>>();
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    points->push_back(cloud.frame.WorldFromLocal(cloud.center[i]));
  }
  for (const auto& other : panes_) other->camera().SetShape(points);
  if (fitted_) fit();
}

void ViewGrid::updateDocument(std::shared_ptr<Document> document) {
  document_ = std::move(document);
  for (const auto& pane : panes_) pane->updateDocument(document_);
}

void ViewGrid::setPaneCount(int count) {
  const int before = count_;
  count_ = std::clamp(count, 1, kMaxPanes);
  if (active_ >= count_) active_ = count_ - 1;
  arrange();
  // A pane that comes back shows what the others see.
  for (int i = before; i < count_; ++i) {
    ViewPane& pane = *panes_[static_cast<std::size_t>(i)];
    if (pane.isLinked()) pane.camera().SetState(panes_[0]->camera().state());
  }
  for (ViewPane* pane : panes()) pane->refresh();
  queue_.setActivePane(activePane()->queueId());
  Q_EMIT activePaneChanged();
}

void ViewGrid::setArrangement(Arrangement arrangement) {
  arrangement_ = arrangement;
  arrange();
}

void ViewGrid::arrange() {
  int columns = count_;
  if (count_ == 4) {
    const bool wide = width() > 2.6 * height();
    if (arrangement_ == Arrangement::kGrid || (arrangement_ == Arrangement::kAutomatic && !wide)) {
      columns = 2;
    }
  } else if (count_ == 3 && arrangement_ == Arrangement::kGrid) {
    columns = 2;
  }
  columns_ = columns;
  for (const auto& pane : panes_) layout_->removeWidget(pane.get());
  for (int i = 0; i < kMaxPanes; ++i) {
    layout_->setColumnStretch(i, i < columns ? 1 : 0);
    layout_->setRowStretch(i, i * columns < count_ ? 1 : 0);
    ViewPane* pane = panes_[static_cast<std::size_t>(i)].get();
    if (i < count_) {
      layout_->addWidget(pane, i / columns, i % columns);
      pane->show();
    } else {
      pane->hide();
      queue_.clear(pane->queueId());
    }
  }
}

void ViewGrid::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  if (count_ == 4 && arrangement_ == Arrangement::kAutomatic) {
    const int wanted = width() > 2.6 * height() ? 4 : 2;
    if (wanted != columns_) arrange();
  }
}

void ViewGrid::setDisplay(const DisplaySettings& display) {
  display_ = display;
  for (const auto& pane : panes_) pane->setDisplay(display_);
}

void ViewGrid::setAllLinked(bool linked) {
  if (linked) {
    for (const auto& pane : panes_) {
      if (pane.get() != activePane()) pane->camera().SetState(activePane()->camera().state());
    }
  }
  for (const auto& pane : panes_) pane->setLinked(linked);
  for (ViewPane* pane : panes()) pane->refresh();
  Q_EMIT cameraChanged();
}

void ViewGrid::shareCamera(ViewPane* source) {
  if (source->isLinked()) {
    for (ViewPane* pane : panes()) {
      if (pane != source && pane->isLinked()) {
        pane->camera().SetState(source->camera().state());
        pane->refresh();
      }
    }
  }
  source->refresh();
  Q_EMIT cameraChanged();
}

void ViewGrid::fit() {
  const QSize size = activePane()->canvas()->pixelSize();
  activePane()->camera().Fit(size.width(), size.height());
  fitted_ = true;
  shareCamera(activePane());
}

void ViewGrid::lookFrom(ViewPreset preset) {
  if (!document_) return;
  const QSize size = activePane()->canvas()->pixelSize();
  ViewContext context;
  context.bounds = document_->bounds();
  context.up = document_->up();
  context.front = document_->front();
  ViewRequest request;
  request.preset = preset;
  activePane()->camera().LookAlong(MakeCamera(context, request, size.width(), size.height()),
                                   size.width(), size.height());
  fitted_ = true;
  shareCamera(activePane());
}

void ViewGrid::setFieldOfView(double fov_x_deg) {
  const QSize size = activePane()->canvas()->pixelSize();
  const double tan_x = std::tan(fov_x_deg * std::numbers::pi / 360.0);
  const double shorter = std::min(size.width(), size.height());
  activePane()->camera().SetViewAngle(2.0 * std::atan(tan_x * shorter / size.width()));
  shareCamera(activePane());
}

void ViewGrid::setProjection(Projection projection) {
  activePane()->camera().SetProjection(projection);
  shareCamera(activePane());
}

void ViewGrid::lookThrough(const Survey& survey, std::size_t photo_idx) {
  fitted_ = false;
  activePane()->camera().LookThrough(CameraOfPhotograph(survey, photo_idx));
  shareCamera(activePane());
}

void ViewGrid::setPhotograph(const QImage& photo, const QString& name) {
  for (const auto& pane : panes_) pane->canvas()->setPhotograph(photo, name);
}

void ViewGrid::setPhotographOpacity(double opacity) {
  for (const auto& pane : panes_) pane->canvas()->setPhotographOpacity(opacity);
}

void ViewGrid::withSurvey(std::function<void(std::shared_ptr<const Survey>)> use) {
  if (!document_ || !document_->project()) return;
  if (survey_) {
    use(survey_);
    return;
  }
  waiting_for_survey_.push_back(std::move(use));
  if (survey_job_) return;
  survey_job_ = new BackgroundJob(this);
  const auto result = std::make_shared<std::shared_ptr<const Survey>>();
  const auto ended = [this] {
    survey_job_->deleteLater();
    survey_job_ = nullptr;
    return std::exchange(waiting_for_survey_, {});
  };
  connect(survey_job_, &BackgroundJob::succeeded, this, [this, result, ended] {
    const auto waiting = ended();
    survey_ = *result;
    for (const auto& call : waiting) call(survey_);
  });
  connect(survey_job_, &BackgroundJob::failed, this, [this, ended](const QString& message) {
    ended();
    Q_EMIT failed(message);
  });
  survey_job_->start([document = document_,
                      result](const Control& control) { *result = document->LoadSurvey(control); },
                     {});
}

}  // namespace sherd
