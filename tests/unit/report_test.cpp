// The page builder and the plots: nothing given as text becomes markup, nothing drawn is lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>
#include <set>

#include "../../src/report/row_thinner.hpp"
#include "../../src/report/ticks.hpp"
#include "report/html.hpp"
#include "report/identification_report.hpp"
#include "report/plot.hpp"
#include "report/statistics.hpp"
#include "upright/base/error.hpp"

namespace upright {
namespace {

const std::string hostile = "<script>alert(1)</script> & \"it's\" `date` $(date) %s \\n {/Symbol a}";

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(HtmlEscaped, LeavesNoMarkupAndRepairsBrokenUtf8) {
  EXPECT_EQ(html_escaped("<a href='x'>\"&"), "&lt;a href=&#39;x&#39;&gt;&quot;&amp;");
  EXPECT_EQ(html_escaped("gr\xc3\xbc\xc3\x9f"), "gr\xc3\xbc\xc3\x9f");
  EXPECT_EQ(html_escaped("a\xff\x01z"), "a\xef\xbf\xbd\xef\xbf\xbdz");
  EXPECT_EQ(html_escaped("\xc3"), "\xef\xbf\xbd");
  EXPECT_EQ(html_escaped("\xed\xa0\x80"), "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd");
}

Plot hostile_plot() {
  Plot plot;
  plot.title = hostile;
  plot.x.label = hostile;
  plot.y.label = hostile;
  plot.series.push_back({hostile, {0, 1, 2}, {0, 1, 0}});
  plot.vertical_marks.push_back({1.0, hostile});
  return plot;
}

TEST(HtmlPage, TextNeverBecomesMarkupAnywhere) {
  HtmlPage page(hostile, hostile);
  page.answer(Tone::bad, hostile, hostile);
  page.section(hostile);
  page.paragraph(hostile);
  page.note(Tone::neutral, hostile);
  page.table({{hostile}, {{hostile}}, hostile});
  page.facts({{hostile, hostile}});
  page.figure(hostile_plot(), hostile);
  page.folded(hostile, hostile);
  page.preformatted(hostile);
  const std::string text = page.text();
  EXPECT_EQ(occurrences(text, "<script"), 0u);
  // On the page as they were given: 16 texts, the title twice, and the plot's title and key; in its two
  // drawings the words of the axes and of a mark.
  EXPECT_EQ(
      occurrences(text, "&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;it&#39;s&quot; `date` $(date) %s"),
      19u);
  EXPECT_EQ(
      occurrences(text, "&#x3c;script&#x3e;alert(1)&#x3c;/script&#x3e; &#x26; &#x22;it&#x27;s&#x22; `date`"),
      6u);
}

TEST(HtmlPage, RefersToNothingElsewhereAndRepeatsNoIdentifier) {
  HtmlPage page("a", "b");
  Plot plot;
  plot.series.push_back({"line", {0, 1, 2}, {0, 1, 0}});
  plot.series.push_back({"points", {0, 1, 2}, {1, 1, 0}, Series::Style::points});
  page.figures({plot, plot}, "twice");
  const std::string text = page.text();
  EXPECT_EQ(text.find("http://"), std::string::npos);
  EXPECT_EQ(text.find("https://"), std::string::npos);
  EXPECT_EQ(text.find("src="), std::string::npos);
  const std::regex identifier("\\bid=['\"]([^'\"]*)['\"]");
  std::set<std::string> seen;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), identifier); it != std::sregex_iterator();
       ++it)
    EXPECT_TRUE(seen.insert((*it)[1]).second) << (*it)[1] << " stands twice";
  EXPECT_FALSE(seen.empty());
  const std::regex reference("(?:href='|url\\()#([A-Za-z0-9_]*)");
  for (auto it = std::sregex_iterator(text.begin(), text.end(), reference); it != std::sregex_iterator();
       ++it)
    EXPECT_TRUE(seen.count((*it)[1])) << (*it)[1] << " is not there";
}

TEST(Svg, EveryKindOfPlotDrawsItsData) {
  for (const auto style :
       {Series::Style::line, Series::Style::steps, Series::Style::points, Series::Style::bars}) {
    Plot plot;
    plot.series.push_back({"s", {0, 1, 2, 3}, {1, 2, 3, 2}, style});
    Plot empty;
    EXPECT_GT(svg_of(plot, "p").size(), svg_of(empty, "p").size());
  }
  Plot map;
  map.x.logarithmic = true;
  map.heat_map =
      HeatMap{{0.1, 1.0, 10.0}, {0.0, 1.0}, {0, 1, 2, 0, 0, 1}, "outcome", {"stable", "osc", "fell"}};
  EXPECT_EQ(svg_of(map, "p").find("xmlns"), std::string::npos);
  EXPECT_EQ(key_of(map).at(1).name, "osc");
}

TEST(Svg, SurvivesEmptyConstantAndNotFiniteData) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const bool log_axis : {false, true}) {
    for (const auto& y : {std::vector<double>{},
                          {5.0},
                          {0.0, 0.0},
                          {nan, nan},
                          {1.0, nan, inf, -inf, 2.0},
                          {-1.0, 0.0, 1.0},
                          {1e300, -1e300},
                          {5e-324, 1e308}}) {
      Plot plot;
      plot.y.logarithmic = log_axis;
      std::vector<double> x(y.size());
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<double>(i);
      plot.series.push_back({"s", x, y});
      EXPECT_NE(svg_of(plot, "p").find("<svg"), std::string::npos);
    }
  }
}

TEST(Svg, RefusesSeriesOfUnequalLengths) {
  Plot plot;
  plot.series.push_back({"s", {0, 1, 2}, {1}});
  EXPECT_THROW(svg_of(plot, "p"), Error);
}

TEST(Palette, GivesAnOutcomeItsColourInEveryPlot) {
  Plot map;
  map.heat_map = HeatMap{{1, 2, 3}, {0, 1}, {0, 1, 2, 0, 1, 2}, "", {"stable", "oscillating", "fell"}};
  const std::vector<KeyEntry> key = key_of(map);
  ASSERT_EQ(key.size(), 3u);
  for (const KeyEntry& entry : key) {
    EXPECT_EQ(entry.color, color::of_outcome(entry.name));
    const auto part = [&](std::size_t at) {
      return std::stoi(std::string(entry.color.substr(at, 2)), nullptr, 16);
    };
    char drawn[32];
    std::snprintf(drawn, sizeof drawn, "rgb(%3d, %3d, %3d)", part(1), part(3), part(5));
    EXPECT_NE(svg_of(map, "p").find(drawn), std::string::npos) << entry.name;
    for (std::size_t k = 0; k < 20; ++k) EXPECT_NE(color::curve(k), entry.color) << "means something else";
  }
}

TEST(Ticks, StandAtStepsThatExist) {
  const auto texts = [](const AxisSpan& axis) {
    std::string text;
    for (const Tick& tick : ticks_of(axis)) text += tick.text + " ";
    return text;
  };
  EXPECT_EQ(texts({0.0, 2.0, false, true, 900.0}), "0 1 2 ") << "counts have no halves";
  EXPECT_EQ(texts({0.0, 2.0, false, false, 240.0}), "0.0 0.5 1.0 1.5 2.0 ");
  EXPECT_EQ(texts({0.9, 6.0, true, false, 240.0, false}), "1 2 3 5 ") << "less than a decade";
  EXPECT_EQ(texts({1e-3, 0.1, true, false, 300.0}), "0.001 0.003 0.01 0.03 0.1 ");
  for (const double length : {120.0, 300.0, 900.0})
    for (const double high : {1e-6, 0.03, 1.0, 17.0, 1e5, 1e12})
      for (const bool log : {false, true}) {
        const AxisSpan axis{log ? 1e-4 * high : -0.3 * high, high, log, false, length};
        const std::vector<Tick> ticks = ticks_of(axis);
        EXPECT_GE(ticks.size(), 1u) << high << " " << length;
        double end = -1e9;
        for (const Tick& tick : ticks) {
          const double part = log ? std::log(tick.at / axis.low) / std::log(axis.high / axis.low)
                                  : (tick.at - axis.low) / (axis.high - axis.low);
          const double half = 0.5 * text_width_px(tick.text, axis.text_px);
          EXPECT_GT(part * length - half, end) << "texts touch: " << texts(axis);
          end = part * length + half;
        }
      }
}

TEST(Ticks, EndForAnyRange) {
  for (const double low : {0.0, 1e17, -1e100, 1e-300})
    for (const double span : {1e-6, 1e-300, 16.0, 1e99})
      EXPECT_LT(ticks_of({low, low + span, false, false, 900.0}).size(), 200u) << low << " " << span;
}

TEST(Align, PutsTheTimeAxesOfStackedPlotsAtOnePlace) {
  Plot small, large;
  small.series.push_back({"", {0.0, 9.0}, {0.0, 1.0}});
  large.series.push_back({"", {1.0, 10.0}, {0.0, 0.123456e-3}});
  std::vector<Plot> plots{small, large};
  align(plots);
  EXPECT_EQ(plots[0].left_px, plots[1].left_px);
  EXPECT_EQ(plots[0].x.low, 0.0);
  EXPECT_EQ(plots[0].x.high, 10.0);
  EXPECT_EQ(plots[1].x.low, 0.0);
  EXPECT_EQ(plots[1].x.high, 10.0);
}

TEST(NumberText, IsPlainWherePeopleReadIt) {
  EXPECT_EQ(number_text(11061.4), "11060");
  EXPECT_EQ(number_text(7512.0, 2), "7500");
  EXPECT_EQ(number_text(-1246.3, 3), "-1250");
  EXPECT_EQ(number_text(9999999.9), "1 × 10⁷");
  EXPECT_EQ(number_text(3.14e-7, 2), "3.1 × 10⁻⁷");
  EXPECT_EQ(number_text(0.00012344), "0.0001234");
  EXPECT_EQ(number_text(0.0), "0");
  EXPECT_EQ(number_text(std::nan("")), "-");
  EXPECT_EQ(number_within(0.4306523, 0.4303976, 0.4309071), "0.43065");
  EXPECT_EQ(number_within(4.03e-6, -1.45e-5, 2.25e-5), "0.000004");
  EXPECT_EQ(number_within(-4.0e-9, -1.45e-5, 2.25e-5), "0.000000");
  EXPECT_EQ(number_within(12345.0, 10000.0, 15000.0), "12300");
}

TEST(LinkTo, LeadsBesideThePageOnly) {
  EXPECT_EQ(link_to("20260101T000000Z-a/report.html"), "./20260101T000000Z-a/report.html");
  EXPECT_EQ(link_to("javascript:alert(1)"), "./javascript%3Aalert%281%29");
  EXPECT_EQ(link_to("a b\"<>"), "./a%20b%22%3C%3E");
}

TEST(Bars, AreOneForEachName) {
  HtmlPage page("a", "b");
  page.bars({{"given", 100.0, color::before}, {"with this", 10.0}, {"with that", 1.0}}, 1.0, "");
  const std::string text = page.text();
  for (const char* part : {"given", "with this", "with that", "width:100%", "width:50%", "width:0%"})
    EXPECT_NE(text.find(part), std::string::npos) << part;
}

TEST(Thinned, KeepsEveryPeakAndTheEnds) {
  std::vector<double> x(200000);
  std::vector<double> y(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = static_cast<double>(i);
    y[i] = std::sin(1e-3 * x[i]);
  }
  y[123457] = 50.0;
  y[77] = -50.0;
  y[50000] = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::size_t> kept = thinned(x, y, 900);
  EXPECT_LT(kept.size(), 5000u);
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  for (const std::size_t must :
       {std::size_t{0}, std::size_t{77}, std::size_t{50000}, std::size_t{123457}, x.size() - 1})
    EXPECT_TRUE(std::binary_search(kept.begin(), kept.end(), must)) << must;
}

TEST(RowThinner, KeepsEveryRowOfAShortRun) {
  RowThinner thinner;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    LogRecord row;
    row.tick = i;
    thinner.add(row);
  }
  const std::vector<LogRecord> rows = thinner.take();
  ASSERT_EQ(rows.size(), 5000u);
  for (std::uint64_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i].tick, i);
}

TEST(RowThinner, LosesNoPeakAndNoGapOfALongRun) {
  constexpr std::uint64_t count = 1'500'000;
  RowThinner thinner;
  for (std::uint64_t i = 0; i < count; ++i) {
    LogRecord row;
    row.tick = i;
    row.theta_rad = 0.01 * std::sin(0.001 * static_cast<double>(i));
    row.cart_m = 0.02 * std::cos(0.0017 * static_cast<double>(i));
    row.wake_late_ns = static_cast<std::int64_t>(i % 1000);
    if (i == 777) row.theta_rad = 1.0;
    if (i == 1'234'567) row.theta_rad = -1.0;
    if (i == 500'001) row.read_ns = 5'000'000;
    if (i == 900'000) row.voltage_requested_v = std::numeric_limits<double>::quiet_NaN();
    thinner.add(row);
  }
  const std::vector<LogRecord> rows = thinner.take();
  EXPECT_LE(rows.size(), RowThinner::max_rows);
  EXPECT_GT(rows.size(), 20'000u) << "several for each column of pixels";
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end(),
                             [](const LogRecord& a, const LogRecord& b) { return a.tick < b.tick; }));
  std::uint64_t widest = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) widest = std::max(widest, rows[i].tick - rows[i - 1].tick);
  EXPECT_LT(widest, count / 1000) << "as dense at the beginning as at the end";
  for (const std::uint64_t must : {std::uint64_t{0}, std::uint64_t{777}, std::uint64_t{1'234'567},
                                   std::uint64_t{500'001}, std::uint64_t{900'000}, count - 1})
    EXPECT_TRUE(std::any_of(rows.begin(), rows.end(), [=](const LogRecord& row) { return row.tick == must; }))
        << must;
}

TEST(ValueCounts, GiveTheQuantilesOfWhatWasCounted) {
  ValueCounts counts;
  EXPECT_EQ(counts.spread().largest, 0.0);
  for (std::int64_t i = 1; i <= 10'000; ++i) counts.add(i);
  EXPECT_EQ(counts.spread().median, 5000.0) << "small ones exactly";
  EXPECT_EQ(counts.spread().p999, 9990.0);
  EXPECT_EQ(counts.sorted().size(), 10'000u);
  ValueCounts large;
  for (std::int64_t i = 1; i <= 100'000; ++i) large.add(1'000 * i);
  EXPECT_NEAR(large.spread().median, 5e7, 5e7 / 32768.0);
  EXPECT_EQ(large.spread().largest, 1e8);
  std::uint64_t total = 0;
  for (const auto& [value, times] : large.sorted()) total += times;
  EXPECT_EQ(total, 100'000u);
}

TEST(Magnitude, IsOfTheFiniteValues) {
  Magnitude magnitude;
  EXPECT_EQ(magnitude.root_mean_square(), 0.0);
  for (const double value : {3.0, -4.0, std::numeric_limits<double>::quiet_NaN()}) magnitude.add(value);
  EXPECT_EQ(magnitude.largest(), 4.0);
  EXPECT_NEAR(magnitude.root_mean_square(), std::sqrt(12.5), 1e-12);
}

TEST(SteadyFriction, IsThatOfThePlantsEffects) {
  Plant plant;
  plant.set("coulomb_friction", {0.5});
  plant.set("stribeck_friction", {0.2, 0.1, 2.0});
  plant.set("viscous_friction", {3.0});
  plant.set("quadratic_drag", {4.0});
  plant.set("constant_force", {0.05});
  const double level_n = 0.5 + 0.2 * std::exp(-4.0);
  EXPECT_NEAR(steady_friction_n(plant, 0.2), level_n + 3.0 * 0.2 + 4.0 * 0.04 - 0.05, 1e-12);
  EXPECT_NEAR(steady_friction_n(plant, -0.2), -level_n - 3.0 * 0.2 - 4.0 * 0.04 - 0.05, 1e-12);
}

TEST(Histogram, CountsEveryValueAsOftenAsItCame) {
  std::vector<std::pair<double, std::uint64_t>> values{{-3.0, 1}, {7.0, 1}};
  for (int i = 0; i < 500; ++i) values.emplace_back(std::cos(0.1 * i), 2);
  const Series series = histogram(values, 40, "h");
  double total = 0.0;
  for (const double count : series.y) total += count;
  EXPECT_EQ(total, 1002.0);
  EXPECT_EQ(histogram({{2.0, 2}}, 10, "h").y.front(), 2.0);
  EXPECT_TRUE(histogram({}, 10, "h").x.empty());
}

}  // namespace
}  // namespace upright
