#include "app/desktop/export_dialog.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDateTime>
#include <QDialogButtonBox>
#include <QDir>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QSettings>
#include <QSpinBox>
#include <QVBoxLayout>

#include "app/project/settings.h"
#include "app/report/sheet.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr int kLargestSide = 32767;

struct SizePreset {
  const char* name;
  int width, height;
};
constexpr SizePreset kPresets[] = {
    {QT_TRANSLATE_NOOP("sherd::ExportDialog", "Full HD"), 1920, 1080},
    {QT_TRANSLATE_NOOP("sherd::ExportDialog", "4K"), 3840, 2160},
    {QT_TRANSLATE_NOOP("sherd::ExportDialog", "A4 landscape, 300 dpi"), 3508, 2480},
    {QT_TRANSLATE_NOOP("sherd::ExportDialog", "A4 portrait, 300 dpi"), 2480, 3508},
    {QT_TRANSLATE_NOOP("sherd::ExportDialog", "A3 landscape, 300 dpi"), 4961, 3508},
};
constexpr const char* kExtensions[] = {"png", "tif", "exr"};
QLabel* labelFor(const QString& text, QWidget* field) {
  auto* label = new QLabel(text, field->parentWidget());
  label->setBuddy(field);
  return label;
}

enum BackgroundChoice { kWhite, kBlack, kGrey, kTransparent };

}  // namespace

ExportDialog::ExportDialog(Kind kind, const Document& document, QSize view_size,
                           const std::vector<std::size_t>& shown, QWidget* parent)
    : QDialog(parent), kind_(kind), title_(QString::fromStdString(document.title())) {
  const bool sheet = kind == Kind::kSheet;
  setObjectName(QStringLiteral("exportDialog"));
  setWindowTitle(sheet ? tr("Export comparison sheet") : tr("Export screenshot"));
  setMinimumWidth(480);
  auto* form = new QFormLayout;
  form->setFieldGrowthPolicy(QFormLayout::AllNonFixedFieldsGrow);

  preset_ = new QComboBox(this);
  if (!sheet) {
    preset_->addItem(tr("As on the screen"), view_size);
    preset_->addItem(tr("Twice the screen"), view_size * 2);
  }
  for (const SizePreset& p : kPresets) preset_->addItem(tr(p.name), QSize(p.width, p.height));
  preset_->addItem(tr("Own size"));
  width_ = new QSpinBox(this);
  height_ = new QSpinBox(this);
  width_->setObjectName(QStringLiteral("width"));
  height_->setObjectName(QStringLiteral("height"));
  width_->setAccessibleName(tr("Width"));
  height_->setAccessibleName(tr("Height"));
  for (QSpinBox* box : {width_, height_}) {
    box->setRange(1, kLargestSide);
    box->setSuffix(tr(" px"));
  }
  auto* size = new QHBoxLayout;
  size->addWidget(width_, 1);
  size->addWidget(new QLabel(QStringLiteral("×"), this));
  size->addWidget(height_, 1);
  form->addRow(tr("&Size"), preset_);
  form->addRow(QString(), size);

  format_ = new QComboBox(this);
  format_->setObjectName(QStringLiteral("format"));
  format_->addItems({tr("PNG"), tr("TIFF"), tr("OpenEXR (linear light)")});
  bits_ = new QComboBox(this);
  bits_->addItem(tr("8 bits a channel"), 8);
  bits_->addItem(tr("16 bits a channel"), 16);
  auto* format = new QHBoxLayout;
  format->addWidget(format_, 1);
  format->addWidget(bits_, 1);
  form->addRow(labelFor(tr("&Format"), format_), format);

  const SettingInfo& supersample = Setting("supersample");
  samples_ = new QSpinBox(this);
  samples_->setObjectName(QStringLiteral("samples"));
  samples_->setRange(static_cast<int>(supersample.min), static_cast<int>(supersample.max));
  samples_->setValue(2);
  samples_->setToolTip(
      QString::fromUtf8(supersample.help.data(), static_cast<qsizetype>(supersample.help.size())));
  form->addRow(tr("S&moothing"), samples_);
  samples_->setSuffix(tr(" × as many rays a side"));

  background_ = new QComboBox(this);
  background_->setObjectName(QStringLiteral("background"));
  background_->addItems({tr("White"), tr("Black"), tr("Dark grey")});
  if (!sheet) background_->addItem(tr("Transparent"));
  form->addRow(tr("&Background"), background_);

  if (sheet) {
    levels_ = new QListWidget(this);
    levels_->setObjectName(QStringLiteral("levels"));
    for (std::size_t i = 0; i < document.levels().size(); ++i) {
      auto* item = new QListWidgetItem(QString::fromStdString(document.levels()[i].name), levels_);
      const bool tick = std::find(shown.begin(), shown.end(), i) != shown.end();
      item->setCheckState(tick ? Qt::Checked : Qt::Unchecked);
    }
    levels_->setMaximumHeight(110);
    form->addRow(tr("&Levels"), levels_);
    csv_ = new QCheckBox(tr("Figures as a table beside it (CSV)"), this);
    separate_ = new QCheckBox(tr("Each level as a picture of its own, too"), this);
    form->addRow(QString(), csv_);
    form->addRow(QString(), separate_);
    connect(levels_, &QListWidget::itemChanged, this, &ExportDialog::check);
  } else {
    scale_bar_ = new QCheckBox(tr("Draw the scale bar"), this);
    scale_bar_->setEnabled(document.metres_per_unit().has_value());
    scale_bar_->setChecked(scale_bar_->isEnabled());
    if (!scale_bar_->isEnabled()) {
      scale_bar_->setToolTip(tr("The scale is not known yet: Project ▸ Set scale"));
    }
    form->addRow(QString(), scale_bar_);
  }

  path_ = new QLineEdit(this);
  path_->setObjectName(QStringLiteral("path"));
  auto* browse_button = new QPushButton(tr("&Browse …"), this);
  auto* place = new QHBoxLayout;
  place->addWidget(path_, 1);
  place->addWidget(browse_button);
  form->addRow(labelFor(tr("F&ile"), path_), place);

  problem_ = new QLabel(this);
  problem_->setObjectName(QStringLiteral("problem"));
  problem_->setWordWrap(true);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel, this);
  export_ = buttons->addButton(tr("&Export"), QDialogButtonBox::AcceptRole);
  export_->setDefault(true);
  auto* layout = new QVBoxLayout(this);
  layout->addLayout(form);
  layout->addWidget(problem_);
  layout->addWidget(buttons);

  const QSettings settings;
  const QString folder =
      settings.value(QStringLiteral("exportFolder"), QDir::homePath()).toString();
  const QString name = sheet ? title_ + tr("-comparison") : title_ + tr("-view");
  path_->setText(QDir(folder).filePath(name + QStringLiteral(".png")));

  connect(preset_, &QComboBox::activated, this, &ExportDialog::takePreset);
  for (QSpinBox* box : {width_, height_}) {
    connect(box, &QSpinBox::valueChanged, this, [this] {
      preset_->setCurrentIndex(preset_->count() - 1);
      check();
    });
  }
  connect(format_, &QComboBox::currentIndexChanged, this, &ExportDialog::takeFormat);
  connect(path_, &QLineEdit::textChanged, this, &ExportDialog::check);
  connect(browse_button, &QPushButton::clicked, this, &ExportDialog::browse);
  connect(buttons, &QDialogButtonBox::accepted, this, [this] {
    QSettings().setValue(QStringLiteral("exportFolder"), QFileInfo(path_->text()).path());
    accept();
  });
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  preset_->setCurrentIndex(0);
  takePreset(0);
}

void ExportDialog::takePreset(int index) {
  const QSize size = preset_->itemData(index).toSize();
  if (size.isValid()) {
    const QSignalBlocker block_width(width_), block_height(height_);
    width_->setValue(size.width());
    height_->setValue(size.height());
  }
  check();
}

void ExportDialog::takeFormat() {
  const QString extension = QLatin1String(kExtensions[format_->currentIndex()]);
  bits_->setEnabled(extension != QLatin1String("exr"));
  const QFileInfo file(path_->text());
  path_->setText(
      QDir(file.path()).filePath(file.completeBaseName() + QLatin1Char('.') + extension));
}

void ExportDialog::check() {
  QString problem;
  const QFileInfo file(path_->text());
  if (path_->text().trimmed().isEmpty() || file.completeBaseName().isEmpty()) {
    problem = tr("Name the file to write.");
  } else if (!QFileInfo(file.path()).isDir()) {
    problem = tr("There is no folder %1.").arg(file.path());
  } else if (kind_ == Kind::kSheet) {
    const auto ticked = levels();
    if (ticked.empty()) {
      problem = tr("Tick at least one level.");
    } else {
      SheetOptions sheet;
      sheet.width = width_->value();
      sheet.height = height_->value();
      try {
        PanelSizeFor(sheet, static_cast<int>(ticked.size()));
      } catch (const Error& error) {
        problem = QString::fromUtf8(error.what());
      }
    }
  }
  problem_->setText(problem);
  problem_->setVisible(!problem.isEmpty());
  export_->setEnabled(problem.isEmpty());
}

void ExportDialog::browse() {
  const QString extension = QLatin1String(kExtensions[format_->currentIndex()]);
  const QString path = QFileDialog::getSaveFileName(this, windowTitle(), path_->text(),
                                                    tr("Pictures (*.%1)").arg(extension));
  if (path.isEmpty()) return;
  path_->setText(QFileInfo(path).suffix().isEmpty() ? path + QLatin1Char('.') + extension : path);
}

PictureExport ExportDialog::options() const {
  PictureExport options;
  options.path = path_->text().toStdString();
  options.width = width_->value();
  options.height = height_->value();
  options.supersample = samples_->value();
  options.bits = bits_->currentData().toInt();
  switch (background_->currentIndex()) {
    case kTransparent:
      options.background.transparent = true;
      break;
    case kBlack:
      options.background.srgb = {0, 0, 0};
      break;
    case kGrey:
      options.background.srgb = {0.15f, 0.155f, 0.17f};
      break;
    default:
      options.background.srgb = {1, 1, 1};
  }
  options.title = title_.toStdString();
  options.subtitle = QDate::currentDate().toString(Qt::ISODate).toStdString();
  if (scale_bar_) options.scale_bar = scale_bar_->isChecked();
  if (csv_) options.csv = csv_->isChecked();
  if (separate_) options.separate = separate_->isChecked();
  return options;
}

std::vector<std::size_t> ExportDialog::levels() const {
  std::vector<std::size_t> ticked;
  for (int i = 0; levels_ && i < levels_->count(); ++i) {
    if (levels_->item(i)->checkState() == Qt::Checked)
      ticked.push_back(static_cast<std::size_t>(i));
  }
  return ticked;
}

}  // namespace sherd
