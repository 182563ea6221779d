// The look of the program: one dark, neutral palette, so that colours are judged against grey.
#pragma once

#include <QColor>

class QApplication;
class QWidget;

namespace sherd::theme {

inline const QColor kCanvas{38, 40, 43};
inline const QColor kWindow{49, 51, 55};
inline const QColor kBase{40, 42, 45};
inline const QColor kText{217, 219, 222};
inline const QColor kDim{150, 154, 160};
inline const QColor kLine{66, 69, 74};
inline const QColor kAccent{94, 160, 178};

// A thin horizontal line between parts of a form.
QWidget* makeLine(QWidget* parent);

// Fusion style, palette and style sheet.
void apply(QApplication* application);

}  // namespace sherd::theme
