// Rows of printed capitals, read by tesseract.
#pragma once

#include <functional>
#include <string>

#include "metaball/vec.h"

namespace sherd::benchmarks {

// Whether the program `tesseract` is there.
bool HaveTesseract();

// Reads one row as tesseract's --psm 7 does (capitals and digits only). `gray(x, y)` is the
// sRGB-encoded luma in [0, 1] of the place x letter heights right of the row's left end and y above
// its baseline; the row is `width` letter heights wide. The row is sampled with 36 pixels a letter
// height, with a margin around it, whatever the picture's own pixels. `scratch`: a folder for the
// picture. Throws Error when tesseract cannot be run.
std::string ReadRow(const std::function<float(double x, double y)>& gray, double width,
                    const std::string& scratch);

// Equal but for blanks.
bool SameText(const std::string& a, const std::string& b);

}  // namespace sherd::benchmarks
