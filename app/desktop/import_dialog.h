// Shows what a workspace holds and what is missing, and asks what to import and which levels to
// build.
#pragma once

#include <QDialog>
#include <cstdint>
#include <vector>

#include "app/project/project.h"
#include "reconstruction/workspace.h"

class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QRadioButton;

namespace sherd {

class LevelSwitches;

struct ImportPlan {
  ImportOptions options;
  std::string project_path;
  std::vector<std::uint64_t> levels;
  LevelOptions level_options;  // target_count is not looked at
};

// "63k, 126k" -> counts, ascending, none twice. Throws InputError naming the part that is no count.
std::vector<std::uint64_t> ParseLevels(const QString& text);
QString formatLevels(const std::vector<std::uint64_t>& levels);

class ImportDialog : public QDialog {
  Q_OBJECT

 public:
  explicit ImportDialog(const Workspace& workspace, QWidget* parent = nullptr);
  ImportPlan plan() const;

 Q_SIGNALS:
  // The cloud is to be shown with all its points, without a project.
  void showAsItIsWanted(const QString& path);

 private:
  QString foundText() const;
  // How many points the present choice has.
  std::uint64_t points() const;
  void sourceChanged();
  void check();

  Workspace workspace_;
  QComboBox* model_;
  QRadioButton* dense_;
  QRadioButton* sparse_;
  QLineEdit* photos_;
  QLineEdit* levels_;
  LevelSwitches* switches_;
  QLineEdit* scale_;
  QLineEdit* most_;
  QLineEdit* project_;
  QLabel* problem_;
  QPushButton* import_;
};

// Asks for the levels to build in an open project.
class LevelsDialog : public QDialog {
  Q_OBJECT

 public:
  LevelsDialog(const Project& project, QWidget* parent = nullptr);
  std::vector<std::uint64_t> levels() const;
  LevelOptions options() const;  // target_count is not set

 private:
  QLineEdit* levels_;
  LevelSwitches* switches_;
};

}  // namespace sherd
