// Asks for size, format and place of a screenshot or a comparison sheet.
#pragma once

#include <QDialog>
#include <QSize>
#include <vector>

#include "app/desktop/document.h"
#include "app/desktop/export.h"

class QCheckBox;
class QComboBox;
class QLabel;
class QLineEdit;
class QListWidget;
class QPushButton;
class QSpinBox;

namespace sherd {

class ExportDialog : public QDialog {
  Q_OBJECT

 public:
  enum class Kind { kScreenshot, kSheet };

  // view_size: the pane's picture in device pixels, the first size offered. shown: the levels in
  // the panes, ticked at first.
  ExportDialog(Kind kind, const Document& document, QSize view_size,
               const std::vector<std::size_t>& shown, QWidget* parent = nullptr);

  PictureExport options() const;
  // Sheets: the levels that are ticked, coarse to fine.
  std::vector<std::size_t> levels() const;

 private:
  void takePreset(int index);
  void takeFormat();
  void check();
  void browse();

  Kind kind_;
  QString title_;
  QComboBox* preset_;
  QSpinBox* width_;
  QSpinBox* height_;
  QComboBox* format_;
  QComboBox* bits_;
  QSpinBox* samples_;
  QComboBox* background_;
  QCheckBox* scale_bar_ = nullptr;
  QListWidget* levels_ = nullptr;
  QCheckBox* csv_ = nullptr;
  QCheckBox* separate_ = nullptr;
  QLineEdit* path_;
  QLabel* problem_;
  QPushButton* export_;
};

}  // namespace sherd
