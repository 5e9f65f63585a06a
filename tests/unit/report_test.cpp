// The page builder and the plots: nothing given as text becomes markup, nothing drawn is lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>
#include <set>

#include "upright/model/error.hpp"
#include "upright/report/html.hpp"
#include "upright/report/plot.hpp"

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
  // 16 texts on the page, the title twice, as they were given; 5 in the drawing.
  EXPECT_EQ(
      occurrences(text, "&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;it&#39;s&quot; `date` $(date) %s"),
      17u);
  EXPECT_EQ(
      occurrences(text, "&#x3c;script&#x3e;alert(1)&#x3c;/script&#x3e; &#x26; &#x22;it&#x27;s&#x22; `date`"),
      5u);
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
  const std::string svg = svg_of(map, "p");
  EXPECT_NE(svg.find("osc"), std::string::npos);
  EXPECT_EQ(svg.find("xmlns"), std::string::npos);
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

TEST(Histogram, CountsEveryFiniteValueOnce) {
  std::vector<double> values{std::numeric_limits<double>::quiet_NaN(), -3.0, 7.0};
  for (int i = 0; i < 1000; ++i) values.push_back(std::cos(0.1 * i));
  const Series series = histogram(values, 40, "h");
  double total = 0.0;
  for (const double count : series.y) total += count;
  EXPECT_EQ(total, 1002.0);
  EXPECT_EQ(histogram({2.0, 2.0}, 10, "h").y.front(), 2.0);
  EXPECT_TRUE(histogram({}, 10, "h").x.empty());
}

}  // namespace
}  // namespace upright
