#include "app/desktop/view_pane.h"

#include <QComboBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QResizeEvent>
#include <QSignalBlocker>
#include <QToolButton>
#include <QVBoxLayout>
#include <utility>

#include "app/desktop/background_job.h"
#include "app/desktop/formatting.h"
#include "app/desktop/info_strip.h"
#include "app/desktop/value_slider.h"

namespace sherd {
namespace {

// Narrower than this the header takes two rows, or three.
constexpr int kOneRow = 900, kTwoRows = 520;
// And the figures below the picture two rows instead of one.
constexpr int kFiguresInOneRow = 620;

}  // namespace

ViewPane::ViewPane(int number, RenderQueue* queue, QWidget* parent)
    : QFrame(parent), queue_(queue), queue_id_(queue->addPane()) {
  setObjectName(QStringLiteral("viewPane"));
  setAccessibleName(tr("View %1").arg(number));
  canvas_ = new ViewCanvas(&camera_, this);
  canvas_->setAccessibleName(tr("Picture of view %1").arg(number));
  strip_ = new InfoStrip(this);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(0);
  buildHeader(number);
  layout->addWidget(canvas_, 1);
  layout->addWidget(strip_);

  connect(canvas_, &ViewCanvas::cameraMoved, this, &ViewPane::cameraMoved);
  connect(canvas_, &ViewCanvas::activated, this, &ViewPane::activated);
  connect(canvas_, &ViewCanvas::resized, this, &ViewPane::refresh);
  connect(queue_, &RenderQueue::viewRendered, this,
          [this](int pane, const std::shared_ptr<const RenderedView>& view) {
            if (pane == queue_id_) takeView(view);
          });
  connect(queue_, &RenderQueue::progressed, this, [this](int pane, double fraction) {
    if (pane == queue_id_) canvas_->setProgress(fraction);
  });
  connect(queue_, &RenderQueue::renderFailed, this, [this](int pane, const QString& message) {
    if (pane != queue_id_) return;
    canvas_->setMessage(message);
    Q_EMIT settled();
  });
  showFigures();
}

ViewPane::~ViewPane() { queue_->removePane(queue_id_); }

void ViewPane::buildHeader(int number) {
  auto* header = new QWidget(this);
  header->setObjectName(QStringLiteral("paneHeader"));
  // All panes are equally wide, whatever their headers would like.
  header->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Fixed);
  header_layout_ = new QBoxLayout(QBoxLayout::TopToBottom, header);
  header_layout_->setContentsMargins(8, 4, 6, 4);
  header_layout_->setSpacing(4);

  level_box_ = new QComboBox(header);
  level_box_->setObjectName(QStringLiteral("level"));
  level_box_->setAccessibleName(tr("Density level of view %1").arg(number));
  level_box_->setToolTip(tr("The density level this view shows ([ and ])"));
  level_box_->setMinimumWidth(84);
  color_box_ = new QComboBox(header);
  color_box_->setObjectName(QStringLiteral("color"));
  color_box_->setAccessibleName(tr("Colours of view %1").arg(number));
  color_box_->setToolTip(
      tr("Blended: every metaball's own colour. Photographs: looked up at each surface point (C)"));
  color_box_->addItems({tr("Blended colours"), tr("Photographs")});
  link_ = new QToolButton(header);
  link_->setObjectName(QStringLiteral("link"));
  link_->setCheckable(true);
  link_->setChecked(true);
  link_->setText(tr("Linked"));
  link_->setAccessibleName(tr("Camera of view %1 linked").arg(number));
  link_->setToolTip(tr("Move this view's camera together with the others' (L)"));

  auto* first = new QHBoxLayout;
  first->setSpacing(6);
  first->addWidget(level_box_);
  first->addWidget(color_box_);
  first->addStretch(1);
  first->addWidget(link_);
  radius_ = new ValueSlider("radius-scale", 0.25, 4.0, header);
  threshold_ = new ValueSlider("threshold", 0.05, 5.0, header);
  value_layout_ = new QBoxLayout(QBoxLayout::LeftToRight);
  value_layout_->addWidget(radius_, 1);
  value_layout_->addWidget(threshold_, 1);
  header_layout_->addLayout(first);
  header_layout_->addLayout(value_layout_, 1);
  layout()->addWidget(header);
  header->setEnabled(false);

  connect(level_box_, &QComboBox::activated, this,
          [this](int index) { setLevel(static_cast<std::size_t>(index)); });
  connect(color_box_, &QComboBox::activated, this,
          [this](int index) { setColorSource(static_cast<PaneColors>(index)); });
  connect(radius_, &ValueSlider::valueChanged, this, &ViewPane::refresh);
  connect(threshold_, &ValueSlider::valueChanged, this, &ViewPane::refresh);
  connect(link_, &QToolButton::toggled, this, &ViewPane::linkToggled);
}

void ViewPane::setDocument(std::shared_ptr<Document> document, std::size_t level_idx) {
  document_ = std::move(document);
  level_.reset();
  survey_.reset();
  level_idx_ = level_idx;
  queue_->clear(queue_id_);
  dropLoading();
  canvas_->setView(nullptr);
  figures_.reset();
  canvas_->setPhotograph({}, {});
  level_box_->clear();
  header_layout_->parentWidget()->setEnabled(document_ != nullptr);
  if (!document_) {
    canvas_->setMessage({});
    showFigures();
    return;
  }
  for (const LevelEntry& level : document_->levels()) {
    level_box_->addItem(QString::fromStdString(level.name));
  }
  color_box_->setEnabled(document_->HasPhotographs());
  color_box_->setCurrentIndex(0);
  canvas_->setMetresPerUnit(document_->metres_per_unit());
  if (document_->levels().empty()) {
    canvas_->setMessage(tr("This project has no levels yet.\nProject ▸ Build levels makes them."));
    showFigures();
    return;
  }
  radius_->setValue(1.0);
  const double threshold = document_->levels()[level_idx_].stats.threshold;
  threshold_->setFallback(threshold);
  threshold_->setValue(threshold);
  level_box_->setCurrentIndex(static_cast<int>(level_idx_));
  loadLevel();
}

void ViewPane::updateDocument(std::shared_ptr<Document> document) {
  document_ = std::move(document);
  canvas_->setMetresPerUnit(document_->metres_per_unit());
  showFigures();
}

void ViewPane::setLevel(std::size_t level_idx) {
  if (!document_ || level_idx >= document_->levels().size()) return;
  if (level_idx == level_idx_ && level_) return;
  const double before = document_->levels()[level_idx_].stats.threshold;
  const double after = document_->levels()[level_idx].stats.threshold;
  // A threshold somebody has chosen stays; the level's own goes with the level.
  if (std::abs(threshold_->value() - before) < 1e-6) threshold_->setValue(after);
  threshold_->setFallback(after);
  level_idx_ = level_idx;
  level_box_->setCurrentIndex(static_cast<int>(level_idx));
  loadLevel();
  Q_EMIT levelChanged();
}

// What is being loaded is not wanted any more: the job deletes itself when it has noticed.
void ViewPane::dropLoading() {
  if (!loading_) return;
  disconnect(loading_, nullptr, this, nullptr);
  connect(loading_, &BackgroundJob::succeeded, loading_, &QObject::deleteLater);
  connect(loading_, &BackgroundJob::cancelled, loading_, &QObject::deleteLater);
  connect(loading_, &BackgroundJob::failed, loading_, &QObject::deleteLater);
  loading_->cancel();
  loading_ = nullptr;
}

void ViewPane::loadLevel() {
  level_.reset();
  queue_->clear(queue_id_);
  canvas_->setProgress(-1);
  const QString name = QString::fromStdString(document_->levels()[level_idx_].name);
  canvas_->setMessage(tr("Loading %1 …").arg(name));
  showFigures();
  dropLoading();
  auto* job = new BackgroundJob(this);
  loading_ = job;
  const auto result = std::make_shared<std::shared_ptr<const Level>>();
  connect(job, &BackgroundJob::succeeded, this, [this, job, result] {
    loading_ = nullptr;
    job->deleteLater();
    level_ = *result;
    canvas_->setMessage({});
    showFigures();
    refresh();
    Q_EMIT levelLoaded();
  });
  connect(job, &BackgroundJob::failed, this, [this, job](const QString& message) {
    loading_ = nullptr;
    job->deleteLater();
    canvas_->setMessage(message);
    Q_EMIT failed(message);
  });
  job->start([document = document_, index = level_idx_,
              result](const Control& control) { *result = document->LoadLevel(index, control); },
             {});
}

Surface ViewPane::surface() const {
  Surface surface;
  surface.threshold = threshold_->value();
  surface.radius_scale = radius_->value();
  return surface;
}

PaneColors ViewPane::colorSource() const {
  return static_cast<PaneColors>(std::max(0, color_box_->currentIndex()));
}

void ViewPane::setColorSource(PaneColors source) {
  if (source == PaneColors::kPhotographs && (!document_ || !document_->HasPhotographs())) return;
  color_box_->setCurrentIndex(static_cast<int>(source));
  if (source == PaneColors::kPhotographs && !survey_) {
    Q_EMIT surveyNeeded();  // setSurvey draws when it is there
    return;
  }
  refresh();
}

bool ViewPane::isLinked() const { return link_->isChecked(); }
void ViewPane::setLinked(bool linked) { link_->setChecked(linked); }

void ViewPane::setDisplay(const DisplaySettings& display) {
  display_ = display;
  canvas_->setBackground(display.background);
  canvas_->setOverlaysVisible(display.overlays);
  refresh();
}

void ViewPane::setSurvey(std::shared_ptr<const Survey> survey) {
  survey_ = std::move(survey);
  if (colorSource() == PaneColors::kPhotographs) refresh();
}

void ViewPane::refresh() {
  canvas_->update();
  if (!level_ || !isVisible()) return;
  RenderRequest request;
  request.level = level_;
  request.surface = surface();
  request.lighting = display_.lighting;
  const QSize size = canvas_->pixelSize();
  request.camera = camera_.MakeCamera(size.width(), size.height());
  if (colorSource() == PaneColors::kPhotographs) request.photos = survey_;
  request.background_srgb = {static_cast<float>(display_.background.redF()),
                             static_cast<float>(display_.background.greenF()),
                             static_cast<float>(display_.background.blueF())};
  request.final_supersample = display_.smooth_when_still ? 2 : 1;
  queue_->request(queue_id_, std::move(request));
}

void ViewPane::setDevice(const QString& backend, const QString& device) {
  backend_ = backend;
  device_ = device;
  showFigures();
}

void ViewPane::takeView(const std::shared_ptr<const RenderedView>& view) {
  // A picture of the level before that was still on its way.
  if (!level_ || view->level != level_) return;
  canvas_->setMessage({});
  canvas_->setView(view);
  // Times of pictures with more rays would not compare with those of other views.
  if (view->samples == 1) figures_ = view;
  showFigures();
  if (view->final) Q_EMIT settled();
}

void ViewPane::showFigures() {
  const QString none = QStringLiteral("–");
  QList<InfoStrip::Field> fields;
  const LevelStats* stats = nullptr;
  std::optional<double> scale;
  QString noise = none;
  QString noise_help = tr("What was done about the noise of this cloud's points is not known");
  if (document_ && level_idx_ < document_->levels().size()) {
    const LevelEntry& entry = document_->levels()[level_idx_];
    stats = &entry.stats;
    scale = document_->metres_per_unit();
    if (document_->project()) {
      noise = QString::fromStdString(NoiseName(entry));
      noise_help =
          entry.options.smooth_noise
              ? tr("The points were moved onto the surface their surroundings stand for before "
                   "this level was made of them")
              : tr("This level was made of the points where they were surveyed");
    }
  }
  const auto length = [&](double value) { return value > 0 ? formatLength(value, scale) : none; };
  const double factor = radius_ ? radius_->value() : 1.0;
  QString count_help;
  if (stats) {
    count_help = tr("of %1 points").arg(formatInteger(stats->source_points));
    if (stats->closing_points > 0) {
      count_help +=
          tr(" and %1 that were added to close holes").arg(formatInteger(stats->closing_points));
    }
  }
  fields.append({tr("Metaballs"), stats ? formatInteger(stats->count) : none, count_help});
  fields.append({tr("Noise"), noise, noise_help});
  fields.append({tr("Spacing"), stats ? length(stats->spacing) : none,
                 tr("Median distance between neighbouring metaballs")});
  fields.append(
      {tr("Radius"), stats ? length(stats->radius_median * factor) : none,
       stats ? tr("Median, radius factor applied; from %1 to %2")
                   .arg(length(stats->radius_min * factor), length(stats->radius_max * factor))
             : QString()});
  const bool errors = stats && stats->HasErrors();
  fields.append(
      {tr("Error"), errors ? formatLength(stats->error_mean, scale) : none,
       errors
           ? tr("Mean distance of the surveyed points from the surface as built; 95 % lie within "
                "%1, the farthest at %2")
                 .arg(formatLength(stats->error_p95, scale), formatLength(stats->error_max, scale))
           : tr("How far the surveyed points lie from the surface is not known")});
  const RenderedView* view = figures_.get();
  QString time = none, time_help, hits = none, hits_help;
  if (view && level_ && view->level == level_) {
    time = formatSeconds(view->seconds);
    if (view->divisor > 1) time.prepend(QStringLiteral("~ "));
    const RenderStats& s = view->stats;
    time_help = tr("%1 × %2 pixels; preparing %3, binning %4, tracing %5")
                    .arg(view->camera.width)
                    .arg(view->camera.height)
                    .arg(formatSeconds(s.seconds_prepare), formatSeconds(s.seconds_bin),
                         formatSeconds(s.seconds_trace));
    if (view->photo_stats) {
      time_help += tr("\nPhotographs %1: %2 of %3 surface pixels from %4 photographs")
                       .arg(formatSeconds(view->photo_stats->seconds),
                            formatInteger(view->photo_stats->from_photos),
                            formatInteger(view->photo_stats->pixels),
                            formatInteger(view->photo_stats->photos_used));
    }
    if (s.rays > 0) {
      hits = formatShare(static_cast<double>(s.hits) / static_cast<double>(s.rays));
      if (s.unresolved > 0) hits += QStringLiteral(" ⚠");
    }
    hits_help =
        tr("%1 of %2 rays meet the surface; %3 started inside, %4 grazed it, %5 were left "
           "undecided")
            .arg(formatInteger(s.hits), formatInteger(s.rays), formatInteger(s.rays_started_inside),
                 formatInteger(s.grazing), formatInteger(s.unresolved));
  }
  fields.append({tr("Time"), time, time_help});
  const QString device = backend_ == QLatin1String("cuda")  ? tr("GPU")
                         : backend_ == QLatin1String("cpu") ? tr("CPU")
                                                            : none;
  fields.append({tr("Device"), device, device_});
  fields.append({tr("Hits"), hits, hits_help});
  strip_->setFields(fields);
}

void ViewPane::resizeEvent(QResizeEvent* event) {
  const int width = event->size().width();
  header_layout_->setDirection(width >= kOneRow ? QBoxLayout::LeftToRight
                                                : QBoxLayout::TopToBottom);
  header_layout_->setSpacing(width >= kOneRow ? 12 : 4);
  value_layout_->setDirection(width >= kTwoRows ? QBoxLayout::LeftToRight
                                                : QBoxLayout::TopToBottom);
  value_layout_->setSpacing(width >= kTwoRows ? 12 : 4);
  strip_->setRows(width >= kFiguresInOneRow ? 1 : 2);
  QFrame::resizeEvent(event);
}

}  // namespace sherd
