#include "app/desktop/import_dialog.h"

#include <QComboBox>
#include <QDialogButtonBox>
#include <QDir>
#include <QDoubleValidator>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QRadioButton>
#include <QSettings>
#include <QVBoxLayout>
#include <algorithm>

#include "app/desktop/document.h"
#include "app/desktop/formatting.h"
#include "app/desktop/level_switches.h"
#include "app/desktop/theme.h"
#include "metaball/error.h"
#include "reconstruction/mesh_import.h"

namespace sherd {
namespace {

QString escaped(const std::string& text) { return QString::fromStdString(text).toHtmlEscaped(); }

// The last two parts of a path say enough beside the whole path at the top.
QString shortPath(const std::string& path) {
  const QStringList parts = QDir::cleanPath(QString::fromStdString(path)).split(QLatin1Char('/'));
  return parts.mid(std::max<qsizetype>(0, parts.size() - 2)).join(QLatin1Char('/')).toHtmlEscaped();
}

QWidget* withBrowse(QLineEdit* edit, QWidget* parent, const std::function<QString()>& ask) {
  auto* row = new QWidget(parent);
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(0, 0, 0, 0);
  auto* button = new QPushButton(ImportDialog::tr("Browse …"), row);
  row->setFocusProxy(edit);
  layout->addWidget(edit, 1);
  layout->addWidget(button);
  QObject::connect(button, &QPushButton::clicked, edit, [edit, ask] {
    const QString answer = ask();
    if (!answer.isEmpty()) edit->setText(answer);
  });
  return row;
}

}  // namespace

std::vector<std::uint64_t> ParseLevels(const QString& text) {
  std::vector<std::uint64_t> levels;
  const QStringList parts = text.split(QLatin1Char(','), Qt::SkipEmptyParts);
  for (const QString& part : parts) {
    if (!part.trimmed().isEmpty()) levels.push_back(ParseCount(part.trimmed().toStdString()));
  }
  std::sort(levels.begin(), levels.end());
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  return levels;
}

QString formatLevels(const std::vector<std::uint64_t>& levels) {
  QStringList names;
  for (const std::uint64_t level : levels) names << QString::fromStdString(FormatCount(level));
  return names.join(QStringLiteral(", "));
}

ImportDialog::ImportDialog(const Workspace& workspace, QWidget* parent)
    : QDialog(parent), workspace_(workspace) {
  setObjectName(QStringLiteral("importDialog"));
  setWindowTitle(tr("Import a survey"));
  setMinimumWidth(620);

  auto* found = new QLabel(foundText(), this);
  found->setObjectName(QStringLiteral("found"));
  found->setTextFormat(Qt::RichText);
  found->setWordWrap(true);
  found->setTextInteractionFlags(Qt::TextSelectableByMouse);

  auto* form = new QFormLayout;
  form->setFieldGrowthPolicy(QFormLayout::AllNonFixedFieldsGrow);
  dense_ = new QRadioButton(tr("&Dense cloud"), this);
  sparse_ = new QRadioButton(tr("S&parse points"), this);
  dense_->setObjectName(QStringLiteral("dense"));
  sparse_->setObjectName(QStringLiteral("sparse"));
  const bool has_dense =
      std::any_of(workspace_.clouds.begin(), workspace_.clouds.end(),
                  [](const DenseCloudFile& cloud) { return cloud.problem.empty(); });
  dense_->setEnabled(has_dense);
  sparse_->setEnabled(!workspace_.models.empty());
  (has_dense ? dense_ : sparse_)->setChecked(true);
  auto* source = new QHBoxLayout;
  source->addWidget(dense_);
  source->addWidget(sparse_);
  source->addStretch(1);
  form->addRow(tr("Points"), source);

  model_ = new QComboBox(this);
  model_->setObjectName(QStringLiteral("model"));
  for (const SparseModelFiles& model : workspace_.models) {
    QString text =
        tr("%1: %2 photographs, %3 points")
            .arg(shortPath(model.folder), formatInteger(model.images), formatInteger(model.points));
    if (!model.problem.empty()) text += tr(" (cannot be read)");
    model_->addItem(text);
  }
  model_->setEnabled(workspace_.models.size() > 1);
  if (workspace_.models.empty()) model_->addItem(tr("none"));
  form->addRow(tr("&Model"), model_);

  photos_ = new QLineEdit(this);
  photos_->setObjectName(QStringLiteral("photos"));
  photos_->setPlaceholderText(tr("where the workspace has them"));
  photos_->setToolTip(
      tr("Only needed when the photographs were moved: they are searched again by "
         "name in this folder"));
  form->addRow(tr("P&hotographs"), withBrowse(photos_, this, [this] {
                 return QFileDialog::getExistingDirectory(this, tr("Folder of the photographs"),
                                                          QString::fromStdString(workspace_.path));
               }));

  levels_ = new QLineEdit(this);
  levels_->setObjectName(QStringLiteral("levels"));
  levels_->setToolTip(tr("How many metaballs each density level has, e.g. 63k, 126k, 0.5M"));
  form->addRow(tr("&Levels"), levels_);
  switches_ = new LevelSwitches(this);
  form->addRow(QString(), switches_);

  most_ = new QLineEdit(this);
  most_->setObjectName(QStringLiteral("most"));
  most_->setPlaceholderText(tr("all"));
  most_->setToolTip(
      tr("For clouds that are too large for this computer: thin them while they are "
         "read to about so many points, e.g. 20M"));
  form->addRow(tr("Points &read at most"), most_);

  scale_ = new QLineEdit(this);
  scale_->setObjectName(QStringLiteral("scale"));
  scale_->setPlaceholderText(tr("not known (can be set later from a measured distance)"));
  form->addRow(tr("M&etres per unit"), scale_);

  project_ = new QLineEdit(this);
  project_->setObjectName(QStringLiteral("project"));
  QFileInfo place(QDir::cleanPath(QString::fromStdString(workspace_.path)));
  const QString name = place.isDir() ? place.fileName() : place.completeBaseName();
  const QString folder =
      QSettings().value(QStringLiteral("projectFolder"), place.path()).toString();
  project_->setText(QDir(folder).filePath(name + QStringLiteral(".sherd")));
  form->addRow(tr("Project &file"), withBrowse(project_, this, [this] {
                 return QFileDialog::getSaveFileName(this, tr("Save the project as"),
                                                     project_->text(), tr("Projects (*.sherd)"));
               }));

  problem_ = new QLabel(this);
  problem_->setObjectName(QStringLiteral("problem"));
  problem_->setWordWrap(true);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel, this);
  import_ = buttons->addButton(tr("&Import"), QDialogButtonBox::AcceptRole);
  import_->setObjectName(QStringLiteral("import"));
  if (place.isFile() && place.suffix().compare(QLatin1String("ply"), Qt::CaseInsensitive) == 0) {
    QPushButton* as_it_is =
        buttons->addButton(tr("Just &look at it"), QDialogButtonBox::ActionRole);
    as_it_is->setObjectName(QStringLiteral("asItIs"));
    as_it_is->setToolTip(tr("Show all points as one level, without a project"));
    connect(as_it_is, &QPushButton::clicked, this, [this] {
      const QString path = QString::fromStdString(workspace_.path);
      reject();
      Q_EMIT showAsItIsWanted(path);
    });
  }
  import_->setDefault(true);

  auto* layout = new QVBoxLayout(this);
  layout->setSpacing(12);
  layout->addWidget(found);
  layout->addWidget(theme::makeLine(this));
  layout->addLayout(form);
  layout->addWidget(problem_);
  layout->addWidget(buttons);

  connect(dense_, &QRadioButton::toggled, this, &ImportDialog::sourceChanged);
  connect(model_, &QComboBox::currentIndexChanged, this, &ImportDialog::sourceChanged);
  for (QLineEdit* edit : {photos_, levels_, most_, scale_, project_}) {
    connect(edit, &QLineEdit::textChanged, this, &ImportDialog::check);
  }
  connect(buttons, &QDialogButtonBox::accepted, this, &QDialog::accept);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  sourceChanged();
}

QString ImportDialog::foundText() const {
  QStringList lines;
  lines << QStringLiteral("<b>%1</b>").arg(escaped(workspace_.path));
  const auto found = [&](const QString& text) {
    lines << QStringLiteral("<span style='color:%1'>✓</span>&nbsp; %2")
                 .arg(theme::kAccent.name(), text);
  };
  const auto problem = [&](const QString& text) {
    lines << QStringLiteral("<span style='color:#d8a657'>!</span>&nbsp; %1").arg(text);
  };
  for (const SparseModelFiles& model : workspace_.models) {
    if (!model.problem.empty()) continue;  // named among what is missing
    found((model.dense_workspace ? tr("Undistorted model %1: %2 photographs, %3 points")
                                 : tr("Sparse model %1: %2 photographs, %3 points"))
              .arg(shortPath(model.folder), formatInteger(model.images),
                   formatInteger(model.points)));
  }
  for (const DenseCloudFile& cloud : workspace_.clouds) {
    if (!cloud.problem.empty()) continue;
    if (IsMeshFileName(cloud.path)) {
      found(tr("Mesh %1: %2 points are taken of its surface")
                .arg(shortPath(cloud.path), formatInteger(cloud.points)));
      continue;
    }
    QStringList with;
    if (cloud.colors) with << tr("colours");
    if (cloud.normals) with << tr("normals");
    if (!cloud.visibility_path.empty()) with << tr("which photograph sees what");
    found(tr("Dense cloud %1: %2 points%3")
              .arg(shortPath(cloud.path), formatInteger(cloud.points),
                   with.isEmpty() ? QString()
                                  : tr(", with %1").arg(with.join(QStringLiteral(", ")))));
  }
  for (const PhotoFolder& folder : workspace_.photo_folders) {
    found(tr("Photographs in %1: %2 files, %3")
              .arg(shortPath(folder.path), formatInteger(folder.files), formatBytes(folder.bytes)));
  }
  const auto unused = std::count_if(
      workspace_.meshes.begin(), workspace_.meshes.end(), [this](const MeshFile& mesh) {
        return std::none_of(workspace_.clouds.begin(), workspace_.clouds.end(),
                            [&](const DenseCloudFile& cloud) { return cloud.path == mesh.path; });
      });
  if (unused > 0) found(tr("%n mesh(es): not needed", nullptr, static_cast<int>(unused)));
  for (const std::string& line : workspace_.missing) problem(escaped(line));
  return lines.join(QStringLiteral("<br>"));
}

std::uint64_t ImportDialog::points() const {
  if (dense_->isChecked()) {
    for (const DenseCloudFile& cloud : workspace_.clouds) {
      if (cloud.problem.empty()) return cloud.points;
    }
    return 0;
  }
  const auto index = static_cast<std::size_t>(std::max(0, model_->currentIndex()));
  return index < workspace_.models.size() ? workspace_.models[index].points : 0;
}

void ImportDialog::sourceChanged() {
  levels_->setText(formatLevels(SuggestLevels(points())));
  check();
}

void ImportDialog::check() {
  QString problem;
  const QFileInfo file(project_->text());
  bool number = true;
  const QString scale = scale_->text().trimmed();
  const double metres = scale.isEmpty() ? 1.0 : QLocale().toDouble(scale, &number);
  try {
    if (!most_->text().trimmed().isEmpty()) ParseCount(most_->text().trimmed().toStdString());
    if (ParseLevels(levels_->text()).empty()) problem = tr("Name at least one level, e.g. 63k.");
  } catch (const Error& error) {
    problem = QString::fromUtf8(error.what());
  }
  if (!problem.isEmpty()) {
  } else if (points() == 0) {
    problem = tr("There are no points to import here.");
  } else if (!number || !(metres > 0)) {
    problem = tr("Metres per unit must be a number above zero, or empty.");
  } else if (!photos_->text().isEmpty() && !QFileInfo(photos_->text()).isDir()) {
    problem = tr("There is no folder %1.").arg(photos_->text());
  } else if (file.completeBaseName().isEmpty() || !QFileInfo(file.path()).isDir()) {
    problem = tr("Name a project file in a folder that exists.");
  }
  problem_->setText(problem);
  problem_->setVisible(!problem.isEmpty());
  import_->setEnabled(problem.isEmpty());
}

ImportPlan ImportDialog::plan() const {
  ImportPlan plan;
  plan.options.source = workspace_.path;
  plan.options.photo_folder = photos_->text().toStdString();
  if (!workspace_.models.empty()) {
    plan.options.model = static_cast<std::size_t>(std::max(0, model_->currentIndex()));
  }
  plan.options.points = dense_->isChecked() ? PointSource::kDense : PointSource::kSparse;
  if (!most_->text().trimmed().isEmpty()) {
    plan.options.decimate_to = ParseCount(most_->text().trimmed().toStdString());
  }
  const QString scale = scale_->text().trimmed();
  if (!scale.isEmpty()) plan.options.metres_per_unit = QLocale().toDouble(scale);
  QString path = project_->text();
  if (!path.endsWith(QLatin1String(".sherd"), Qt::CaseInsensitive)) path += QLatin1String(".sherd");
  plan.project_path = path.toStdString();
  plan.levels = ParseLevels(levels_->text());
  plan.level_options = switches_->options();
  return plan;
}

LevelsDialog::LevelsDialog(const Project& project, QWidget* parent) : QDialog(parent) {
  setObjectName(QStringLiteral("levelsDialog"));
  setWindowTitle(tr("Build levels"));
  setMinimumWidth(420);
  const std::uint64_t points = project.import_summary().points;
  auto* text =
      new QLabel(tr("The survey has %1 points. Each level is a number of metaballs; a level "
                    "that exists is built again.")
                     .arg(formatInteger(points)),
                 this);
  text->setWordWrap(true);
  levels_ = new QLineEdit(this);
  levels_->setObjectName(QStringLiteral("levels"));
  levels_->setAccessibleName(tr("Levels"));
  std::vector<std::uint64_t> wanted;
  for (const std::uint64_t level : SuggestLevels(points)) {
    const std::string name = FormatCount(level);
    const bool there = std::any_of(project.levels().begin(), project.levels().end(),
                                   [&](const LevelEntry& entry) { return entry.name == name; });
    if (!there) wanted.push_back(level);
  }
  levels_->setText(formatLevels(wanted));
  levels_->setPlaceholderText(tr("e.g. 63k, 126k, 1M"));
  switches_ = new LevelSwitches(this);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Cancel, this);
  QPushButton* build = buttons->addButton(tr("&Build"), QDialogButtonBox::AcceptRole);
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(text);
  layout->addWidget(levels_);
  layout->addWidget(switches_);
  layout->addWidget(buttons);
  const auto check = [this, build] {
    try {
      build->setEnabled(!ParseLevels(levels_->text()).empty());
      levels_->setToolTip({});
    } catch (const Error& error) {
      build->setEnabled(false);
      levels_->setToolTip(QString::fromUtf8(error.what()));
    }
  };
  connect(levels_, &QLineEdit::textChanged, this, check);
  connect(buttons, &QDialogButtonBox::accepted, this, &QDialog::accept);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  check();
}

std::vector<std::uint64_t> LevelsDialog::levels() const { return ParseLevels(levels_->text()); }

LevelOptions LevelsDialog::options() const { return switches_->options(); }

}  // namespace sherd
