#include "app/desktop/side_panels.h"

#include <QCheckBox>
#include <QCollator>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QSlider>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "app/desktop/theme.h"
#include "app/desktop/value_slider.h"

namespace sherd {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// As people sort names: IMG_9 before IMG_10.
std::vector<std::size_t> byName(const Survey& survey) {
  QCollator collator;
  collator.setNumericMode(true);
  std::vector<QCollatorSortKey> keys;
  std::vector<std::size_t> order;
  for (const Photograph& photograph : survey.photographs) {
    order.push_back(keys.size());
    keys.push_back(collator.sortKey(QString::fromStdString(photograph.name)));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
  return order;
}

}  // namespace

LightPanel::LightPanel(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("lightPanel"));
  lit_ = new QCheckBox(tr("Light and shade"), this);
  lit_->setChecked(true);
  lit_->setToolTip(tr("Without it the surface shows its plain colours"));
  ambient_ = new ValueSlider("ambient", 0.0, 1.0, this);
  diffuse_ = new ValueSlider("diffuse", 0.0, 1.0, this);
  raking_ = new QCheckBox(tr("Raking light from a fixed side"), this);
  raking_->setObjectName(QStringLiteral("raking"));
  raking_->setToolTip(
      tr("Else the light comes from the viewer. Light from low down shows tool "
         "marks and edges."));
  azimuth_ = new QSlider(Qt::Horizontal, this);
  azimuth_->setRange(0, 359);
  azimuth_->setValue(315);
  azimuth_->setAccessibleName(tr("Side the light comes from, degrees"));
  azimuth_->setToolTip(
      tr("Seen from above, clockwise: 0° from behind the front view, 90° from its "
         "right, 180° from the viewer"));
  elevation_ = new QSlider(Qt::Horizontal, this);
  elevation_->setRange(0, 90);
  elevation_->setValue(20);
  elevation_->setAccessibleName(tr("Height of the light above the horizon, degrees"));
  azimuth_text_ = new QLabel(this);
  elevation_text_ = new QLabel(this);
  fov_ = new ValueSlider("fov-x", 10.0, 120.0, this);

  auto* raking = new QGridLayout;
  raking->setContentsMargins(20, 0, 0, 0);
  raking->addWidget(new QLabel(tr("Side"), this), 0, 0);
  raking->addWidget(azimuth_, 0, 1);
  raking->addWidget(azimuth_text_, 0, 2);
  raking->addWidget(new QLabel(tr("Height"), this), 1, 0);
  raking->addWidget(elevation_, 1, 1);
  raking->addWidget(elevation_text_, 1, 2);
  raking->setColumnMinimumWidth(2, fontMetrics().horizontalAdvance(QStringLiteral("000°")));
  auto* layout = new QVBoxLayout(this);
  layout->setSpacing(8);
  layout->addWidget(lit_);
  layout->addWidget(ambient_);
  layout->addWidget(diffuse_);
  layout->addWidget(raking_);
  layout->addLayout(raking);
  layout->addWidget(theme::makeLine(this));
  layout->addWidget(fov_);
  layout->addStretch(1);

  const auto changed = [this] {
    const bool lit = lit_->isChecked(), raking_on = lit && raking_->isChecked();
    for (QWidget* widget : std::initializer_list<QWidget*>{ambient_, diffuse_, raking_}) {
      widget->setEnabled(lit);
    }
    for (QWidget* widget :
         std::initializer_list<QWidget*>{azimuth_, elevation_, azimuth_text_, elevation_text_}) {
      widget->setEnabled(raking_on);
    }
    azimuth_text_->setText(QStringLiteral("%1°").arg(azimuth_->value()));
    elevation_text_->setText(QStringLiteral("%1°").arg(elevation_->value()));
    Q_EMIT lightingChanged();
  };
  connect(lit_, &QCheckBox::toggled, this, changed);
  connect(raking_, &QCheckBox::toggled, this, changed);
  connect(ambient_, &ValueSlider::valueChanged, this, changed);
  connect(diffuse_, &ValueSlider::valueChanged, this, changed);
  connect(azimuth_, &QSlider::valueChanged, this, changed);
  connect(elevation_, &QSlider::valueChanged, this, changed);
  connect(fov_, &ValueSlider::valueChanged, this, &LightPanel::fieldOfViewChanged);
  changed();
}

void LightPanel::setAxes(const Vec3d& east, const Vec3d& north, const Vec3d& up) {
  east_ = east;
  north_ = north;
  up_ = up;
}

Lighting LightPanel::lighting() const {
  Lighting lighting;
  lighting.unlit = !lit_->isChecked();
  lighting.ambient = ambient_->value();
  lighting.diffuse = diffuse_->value();
  lighting.headlight = !raking_->isChecked();
  const double azimuth = azimuth_->value() * kDegree;
  const double elevation = elevation_->value() * kDegree;
  lighting.to_light =
      (north_ * std::cos(azimuth) + east_ * std::sin(azimuth)) * std::cos(elevation) +
      up_ * std::sin(elevation);
  return lighting;
}

PhotographPanel::PhotographPanel(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("photographPanel"));
  filter_ = new QLineEdit(this);
  filter_->setPlaceholderText(tr("Search by name"));
  filter_->setClearButtonEnabled(true);
  filter_->setAccessibleName(tr("Search photographs by name"));
  list_ = new QListWidget(this);
  list_->setObjectName(QStringLiteral("photographs"));
  list_->setAccessibleName(tr("Photographs"));
  list_->setUniformItemSizes(true);
  count_ = new QLabel(this);
  count_->setWordWrap(true);
  opacity_ = new QSlider(Qt::Horizontal, this);
  opacity_->setObjectName(QStringLiteral("opacity"));
  opacity_->setRange(0, 100);
  opacity_->setAccessibleName(tr("Opacity of the photograph over the view"));
  auto* over = new QHBoxLayout;
  over->addWidget(new QLabel(tr("Photograph over the view"), this));
  over->addWidget(opacity_, 1);
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(filter_);
  layout->addWidget(list_, 1);
  layout->addWidget(count_);
  layout->addLayout(over);
  connect(filter_, &QLineEdit::textChanged, this, &PhotographPanel::filter);
  connect(list_, &QListWidget::currentItemChanged, this,
          [this](const QListWidgetItem* item) { choose(item); });
  connect(opacity_, &QSlider::valueChanged, this,
          [this](int value) { Q_EMIT opacityChanged(value / 100.0); });
}

void PhotographPanel::setSurvey(std::shared_ptr<const Survey> survey) {
  survey_ = std::move(survey);
  const QSignalBlocker blocker(list_);
  list_->clear();
  count_->clear();
  if (!survey_) return;
  std::size_t found = 0;
  for (const std::size_t photo_idx : byName(*survey_)) {
    const Photograph& photograph = survey_->photographs[photo_idx];
    auto* item = new QListWidgetItem(QString::fromStdString(photograph.name), list_);
    item->setData(Qt::UserRole, static_cast<qulonglong>(photo_idx));
    if (photograph.path.empty()) {
      item->setForeground(theme::kDim);
      item->setToolTip(tr("The file was not found; its camera is known"));
    } else {
      item->setToolTip(QString::fromStdString(photograph.path));
      ++found;
    }
  }
  count_->setText(
      tr("%1 photographs, %2 with their file").arg(survey_->photographs.size()).arg(found));
  filter(filter_->text());
}

void PhotographPanel::step(int by) {
  const int count = list_->count();
  if (count == 0) return;
  int row = list_->currentRow();
  if (row < 0) row = by > 0 ? -1 : count;
  for (int tried = 0; tried < count; ++tried) {
    row = (row + by + count) % count;
    if (!list_->item(row)->isHidden()) break;
  }
  if (row == list_->currentRow()) {
    choose(list_->item(row));
  } else {
    list_->setCurrentRow(row);
  }
}

void PhotographPanel::choose(const QListWidgetItem* item) {
  if (item) Q_EMIT photographChosen(item->data(Qt::UserRole).toULongLong());
}

void PhotographPanel::filter(const QString& text) {
  for (int i = 0; i < list_->count(); ++i) {
    list_->item(i)->setHidden(!list_->item(i)->text().contains(text, Qt::CaseInsensitive));
  }
}

}  // namespace sherd
