// What sizes depend on from run to run: what records show, and labels.
#include "diagnosis/run_features.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "measurement/dataset_file.hpp"

namespace upright {
namespace {

/// Runs about places on the track, with one label.
std::vector<Measurement> labelled_runs(const std::vector<double>& places_m, const std::string& label,
                                       const std::vector<std::string>& texts) {
  std::vector<Measurement> runs;
  for (std::size_t r = 0; r < texts.size(); ++r) {
    Measurement run;
    run.voltage_v = {1.0, -1.0, 1.0, -1.0};
    run.cart_m = {places_m[r], places_m[r] + 0.1, places_m[r], places_m[r] + 0.1};
    auto dataset = std::make_shared<Dataset>();
    if (!texts[r].empty()) dataset->labels[label] = texts[r];
    run.dataset = dataset;
    runs.push_back(run);
  }
  return runs;
}

std::vector<RunDependence> dependences(const std::vector<double>& sizes,
                                       const std::vector<Measurement>& runs) {
  std::vector<const Measurement*> of;
  for (const Measurement& run : runs) of.push_back(&run);
  return dependences_of(Eigen::Map<const Eigen::VectorXd>(sizes.data(), std::ssize(sizes)), of);
}

const std::vector<double> same_place(6, 0.2);

TEST(RunFeatures, ASizeByTheDayIsFoundByItsLabel) {
  const auto runs = labelled_runs(same_place, "oiled", {"yes", "no", "yes", "no", "no", "yes"});
  const auto found = dependences({0.50, 0.81, 0.52, 0.79, 0.80, 0.51}, runs);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].on, "the label oiled");
  EXPECT_EQ(found[0].texts[1], "no");
}

TEST(RunFeatures, ASizeThatGrowsWithTimeIsFound) {
  const auto runs = labelled_runs(
      same_place, "recorded",
      {"2026-03-01", "2026-03-02", "2026-03-04 12:00", "2026-03-05", "2026-03-08", "2026-03-09T06:00:00Z"});
  const auto found = dependences({0.10, 0.12, 0.17, 0.18, 0.24, 0.265}, runs);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].on, "the time of recording");
}

TEST(RunFeatures, APlaceIsPreferredToALabelThatSaysLess) {
  const auto runs = labelled_runs({0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, "operator", {"a", "a", "b", "a", "b", "b"});
  const auto found = dependences({0.11, 0.20, 0.30, 0.41, 0.50, 0.60}, runs);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].on, "the place on the track");
  EXPECT_TRUE(found[0].texts.empty());
}

TEST(RunFeatures, WhatTheRunsDoNotTellApartIsAllNamed) {
  const auto runs =
      labelled_runs({0.1, 0.5, 0.1, 0.5, 0.1, 0.5}, "oiled", {"yes", "no", "yes", "no", "yes", "no"});
  const auto found = dependences({0.50, 0.81, 0.52, 0.79, 0.51, 0.80}, runs);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].on == "the label oiled" ? found[1].on : found[0].on, "the place on the track");
}

TEST(RunFeatures, SizesWithoutOrderDependOnNothing) {
  const auto runs = labelled_runs({0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, "operator", {"a", "b", "b", "a", "b", "a"});
  EXPECT_EQ(dependences({0.3, 0.1, 0.5, 0.2, 0.4, 0.35}, runs).size(), 0u);
}

TEST(RunFeatures, ALabelCountsOnlyIfAllRunsHaveIt) {
  const auto runs = labelled_runs(same_place, "oiled", {"yes", "no", "yes", "", "no", "yes"});
  EXPECT_EQ(dependences({0.50, 0.81, 0.52, 0.79, 0.80, 0.51}, runs).size(), 0u);
}

TEST(RunFeatures, ThreeRunsAreTooFew) {
  const auto runs = labelled_runs({0.1, 0.2, 0.3}, "oiled", {"yes", "no", "yes"});
  EXPECT_EQ(dependences({0.1, 0.2, 0.3}, runs).size(), 0u);
}

TEST(RunFeatures, ADateIsTheHoursSince1970) {
  EXPECT_EQ(label_number("1970-01-03"), 48.0);
  EXPECT_EQ(label_number("1970-01-01 10:30"), 10.5);
  EXPECT_EQ(label_number("1970-01-01T01:00:36Z"), 1.01);
  EXPECT_EQ(label_number("-2.5e1"), -25.0);
}

TEST(RunFeatures, WhatIsNeitherNumberNorDateIsAText) {
  for (const char* text :
       {"monday", "3 days", "2026-02-30", "2026-01-01x", "2026-01-01 10", "2026-01-01 10:61", "", "inf", "Z"})
    EXPECT_FALSE(label_number(text)) << text;
}

}  // namespace
}  // namespace upright
