#include "app/project/format.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdlib>
#include <string>

#include "app/project/settings.h"
#include "metaball/error.h"

namespace sherd {
namespace {

TEST(Format, NumbersKeepTheirSignificantDigits) {
  EXPECT_EQ(FormatNumber(0), "0");
  EXPECT_EQ(FormatNumber(1.5), "1.5");
  EXPECT_EQ(FormatNumber(0.70000001), "0.7");
  EXPECT_EQ(FormatNumber(123456, 3), "123456");  // never less than the whole part
  EXPECT_EQ(FormatNumber(0.00012345, 3), "0.000123");
  EXPECT_EQ(FormatNumber(0.000012345, 3), "1.23e-05");
  EXPECT_EQ(FormatNumber(1.2e9, 4), "1.2e+09");
  EXPECT_EQ(FormatNumber(9.9996, 4), "10");
  EXPECT_EQ(FormatNumber(-2.25, 3), "-2.25");
  EXPECT_EQ(FormatNumber(NAN), "nan");
  EXPECT_EQ(FormatNumber(-INFINITY), "-inf");
}

TEST(Format, ExactTextReadsBackAsTheSameNumber) {
  for (const double v : {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, -123456789.123456789}) {
    EXPECT_EQ(std::strtod(FormatExact(v).c_str(), nullptr), v);
  }
}

TEST(Format, CountsBytesSecondsAndShares) {
  EXPECT_EQ(FormatGrouped(0), "0");
  EXPECT_EQ(FormatGrouped(999), "999");
  EXPECT_EQ(FormatGrouped(1000), "1,000");
  EXPECT_EQ(FormatGrouped(1234567890), "1,234,567,890");
  EXPECT_EQ(FormatBytes(1023), "1023 B");
  EXPECT_EQ(FormatBytes(1536), "1.5 KiB");
  EXPECT_EQ(FormatBytes(5ull << 40), "5 TiB");
  EXPECT_EQ(FormatSeconds(0.0123), "12 ms");
  EXPECT_EQ(FormatSeconds(3.21), "3.2 s");
  EXPECT_EQ(FormatSeconds(59.7), "1 min 0 s");
  EXPECT_EQ(FormatSeconds(7300), "2 h 1 min");
  EXPECT_EQ(FormatSeconds(NAN), "?");
  EXPECT_EQ(FormatShare(0), "0 %");
  EXPECT_EQ(FormatShare(0.00001), "< 0.01 %");
  EXPECT_EQ(FormatShare(0.0018), "0.18 %");
  EXPECT_EQ(FormatShare(0.0312), "3.1 %");
  EXPECT_EQ(FormatShare(1), "100 %");
}

TEST(Format, LengthsTakeTheUnitThatFits) {
  EXPECT_EQ(FormatLength(0.0049, std::nullopt), "0.0049 units");
  EXPECT_EQ(FormatLength(0.0049, 1.0), "4.9 mm");
  EXPECT_EQ(FormatLength(0.25, 2.0), "500 mm");
  EXPECT_EQ(FormatLength(0.99996, 1.0), "1 m");  // not 1000 mm
  EXPECT_EQ(FormatLength(1234.0, 1.0), "1.23 km");
  EXPECT_EQ(FormatLength(-2.0, 1.0), "-2 m");
}

TEST(Format, ForeignLocaleChangesNothing) {
  // A locale with a decimal comma where the machine has one; the C locale is as good a test of the
  // rest.
  std::setlocale(LC_ALL, "de_DE.UTF-8");
  EXPECT_EQ(FormatNumber(1.5), "1.5");
  EXPECT_EQ(FormatExact(1.5), "1.5");
  std::setlocale(LC_ALL, "C");
}

TEST(Settings, DefaultsLieInTheirRangesAndNamesAreUnique) {
  for (const SettingInfo& a : Settings()) {
    EXPECT_LT(a.min, a.max) << a.name;
    EXPECT_LE(a.fallback, a.max) << a.name;
    // Below the range means that what is taken by default is not a number (the picture's width).
    if (a.name != "ortho-width") {
      EXPECT_GE(a.fallback, a.min) << a.name;
    }
    EXPECT_FALSE(a.help.empty()) << a.name;
    EXPECT_EQ(&Setting(a.name), &a);
  }
  EXPECT_THROW(Setting("no-such-setting"), Error);
}

}  // namespace
}  // namespace sherd
