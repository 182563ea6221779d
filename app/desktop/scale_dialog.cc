#include "app/desktop/scale_dialog.h"

#include <QDialogButtonBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QLocale>
#include <QPushButton>
#include <QVBoxLayout>

#include "app/desktop/formatting.h"

namespace sherd {

ScaleDialog::ScaleDialog(std::optional<double> metres_per_unit, QWidget* parent)
    : QDialog(parent),
      factor_(new QLineEdit(this)),
      points_(new QLabel(this)),
      distance_(new QLineEdit(this)) {
  setObjectName(QStringLiteral("scaleDialog"));
  setWindowTitle(tr("Set scale"));
  setMinimumWidth(400);
  auto* text = new QLabel(tr("Click two points in the views whose distance you have measured, and "
                             "enter it; or enter the metres of one unit of the survey."),
                          this);
  text->setWordWrap(true);
  points_->setObjectName(QStringLiteral("points"));
  points_->setWordWrap(true);
  distance_->setObjectName(QStringLiteral("distance"));
  distance_->setPlaceholderText(tr("metres"));
  factor_->setObjectName(QStringLiteral("factor"));
  factor_->setPlaceholderText(tr("not known"));
  if (metres_per_unit) factor_->setText(QLocale().toString(*metres_per_unit, 'g', 9));
  auto* form = new QFormLayout;
  form->addRow(tr("Points"), points_);
  form->addRow(tr("&Distance in metres"), distance_);
  form->addRow(tr("&Metres per unit"), factor_);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel, this);
  set_ = buttons->addButton(tr("&Set"), QDialogButtonBox::AcceptRole);
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(text);
  layout->addLayout(form);
  layout->addWidget(buttons);
  connect(distance_, &QLineEdit::textChanged, this, &ScaleDialog::fromDistance);
  connect(factor_, &QLineEdit::textChanged, this, &ScaleDialog::check);
  connect(buttons, &QDialogButtonBox::accepted, this, &QDialog::accept);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  showPoints();
  check();
}

void ScaleDialog::addPoint(const SurfaceHit& hit) {
  if (!first_ || second_) {
    first_ = hit.point;
    second_.reset();
  } else {
    second_ = hit.point;
  }
  showPoints();
  fromDistance();
}

void ScaleDialog::showPoints() {
  distance_->setEnabled(second_.has_value());
  if (!first_) {
    points_->setText(tr("click the first point"));
  } else if (!second_) {
    points_->setText(tr("click the second point"));
  } else {
    points_->setText(tr("%1 apart").arg(formatLength(Length(*second_ - *first_), {})));
  }
}

void ScaleDialog::fromDistance() {
  if (!second_ || distance_->text().trimmed().isEmpty()) return;
  bool ok = false;
  const double metres = QLocale().toDouble(distance_->text().trimmed(), &ok);
  const double units = Length(*second_ - *first_);
  if (ok && metres > 0 && units > 0) {
    factor_->setText(QLocale().toString(metres / units, 'g', 9));
  }
}

void ScaleDialog::check() {
  const QString text = factor_->text().trimmed();
  bool ok = true;
  const double value = text.isEmpty() ? 1.0 : QLocale().toDouble(text, &ok);
  set_->setEnabled(ok && value > 0 && std::isfinite(value));
}

std::optional<double> ScaleDialog::metresPerUnit() const {
  const QString text = factor_->text().trimmed();
  if (text.isEmpty()) return std::nullopt;
  return QLocale().toDouble(text);
}

}  // namespace sherd
