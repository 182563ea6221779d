// What is drawn over a picture: scale bar, axes. Shared by the window and by exported screenshots.
#pragma once

#include <QColor>
#include <QPainter>
#include <QRectF>

#include "app/report/scale_bar.h"
#include "metaball/camera.h"

namespace sherd {

// Draws `bar` into the lower-left corner of `area` (painter units). unit_px painter units are one
// pixel of the interface at 96 dpi, so that text and lines grow with an export's size;
// device_ratio pixels of the camera's picture are one painter unit.
void drawScaleBar(QPainter* painter, const QRectF& area, const ScaleBar& bar, double unit_px,
                  double device_ratio, bool perspective);

// How long a scale bar may be in a picture `width` painter units wide.
double longestScaleBar(double width, double unit_px);

// The world's axes as a small cross in the lower-right corner.
void drawAxes(QPainter* painter, const QRectF& area, const Camera& camera, double unit_px);

}  // namespace sherd
