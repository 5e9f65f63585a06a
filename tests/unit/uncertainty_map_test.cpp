// The map of falls in a report: contours, tolerated delays, files that are not whole.
#include "report/uncertainty_map.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "sweep/uncertainty.hpp"
#include "upright/base/error.hpp"

namespace upright {
namespace {

class UncertaintyMapFile : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(file_); }

  std::filesystem::path written(const std::string& rows) const {
    std::ofstream(file_) << uncertainty_header << "\n" << rows;
    return file_;
  }
  /// Of 100 plants.
  static std::string row(double theta0, double delay, double share) {
    return std::to_string(theta0) + "," + std::to_string(delay) + ",100," + std::to_string(share) +
           ",0,1,0,0,1\n";
  }

  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("upright-uncertainty-map-" + std::to_string(getpid()) + ".csv");
};

TEST_F(UncertaintyMapFile, HasContoursBetweenTheDelays) {
  const UncertaintyMap map =
      read_uncertainty_map(written(row(0.1, 0.0, 0.0) + row(0.1, 0.01, 0.2) + row(0.1, 0.02, 1.0) +
                                   row(0.2, 0.0, 0.6) + row(0.2, 0.01, 0.7) + row(0.2, 0.02, 0.8)));
  EXPECT_EQ(map.samples, 100.0);
  EXPECT_EQ(map.tolerated_s[0], 0.0);
  EXPECT_TRUE(std::isnan(map.tolerated_s[1]));
  const std::vector<FallContour> contours = fall_contours(map);
  ASSERT_EQ(contours.size(), 3u);
  EXPECT_EQ(contours[0].share, 0.1);
  EXPECT_NEAR(contours[0].delay_s[0], 0.005, 1e-12);
  EXPECT_NEAR(contours[1].delay_s[0], 0.01 + 0.01 * 0.3 / 0.8, 1e-12);
  EXPECT_NEAR(contours[2].delay_s[0], 0.01 + 0.01 * 0.7 / 0.8, 1e-12);
  // Above 10 and 50 percent at the first delay, below 90 percent at the last.
  for (const FallContour& contour : contours) EXPECT_TRUE(std::isnan(contour.delay_s[1]));
  EXPECT_EQ(uncertainty_plot(map).series.size(), 3u);
  EXPECT_EQ(uncertainty_table(map).rows.size(), 2u);
}

TEST_F(UncertaintyMapFile, IsRefusedWhereItIsNotWhole) {
  for (const std::string& rows :
       {std::string(), row(0.1, 0.0, 0.0) + row(0.1, 0.01, 0.2) + row(0.2, 0.0, 0.6),
        row(0.1, 0.01, 0.0) + row(0.1, 0.0, 0.2), row(0.1, 0.0, 1.2), std::string("0.1,0,0,0,0,0,0,0,0\n")})
    EXPECT_THROW(read_uncertainty_map(written(rows)), ConfigError) << rows;
}

}  // namespace
}  // namespace upright
