#include "row_json.hpp"

#include <charconv>
#include <cmath>
#include <string_view>

namespace upright {

namespace {

/// Appends `"name":value` pairs.
class JsonLine {
 public:
  explicit JsonLine(char* out) noexcept : begin_(out), at_(out) {}

  void add(std::string_view name, double value) noexcept {
    if (std::isfinite(value)) put(name, value);
  }
  template <class Integer>
  void add_whole(std::string_view name, Integer value) noexcept {
    put(name, value);
  }
  std::size_t end() noexcept {
    *at_++ = '}';
    return static_cast<std::size_t>(at_ - begin_);
  }

 private:
  template <class Number>
  void put(std::string_view name, Number value) noexcept {
    constexpr std::size_t longest_number = 40;
    *at_ = at_ == begin_ ? '{' : ',';
    ++at_;
    *at_++ = '"';
    at_ += name.copy(at_, name.size());
    *at_++ = '"';
    *at_++ = ':';
    at_ = std::to_chars(at_, at_ + longest_number, value).ptr;
  }

  char* begin_;
  char* at_;
};

double in_us(std::int64_t ns) noexcept {
  return static_cast<double>(ns) / 1e3;
}

}  // namespace

std::size_t format_row_json(const LogRecord& row, char* out) noexcept {
  JsonLine line(out);
  const double time_s = static_cast<double>(row.time_ns) / 1e9;
  line.add("timestamp", time_s);
  line.add_whole("tick", row.tick);
  line.add("time_s", time_s);
  line.add_whole("cart_counts", row.cart_counts);
  line.add_whole("pendulum_counts", row.pendulum_counts);
  line.add("cart_m", row.cart_m);
  line.add("theta_rad", row.theta_rad);
  line.add("cart_velocity_mps", row.cart_velocity_mps);
  line.add("pendulum_rate_radps", row.pendulum_rate_radps);
  line.add("voltage_requested_v", row.voltage_requested_v);
  line.add("voltage_v", row.voltage_v);
  line.add("wake_late_us", in_us(row.wake_late_ns));
  line.add("read_us", in_us(row.read_ns));
  line.add("compute_us", in_us(row.compute_ns));
  line.add("write_us", in_us(row.write_ns));
  line.add_whole("flags", row.flags);
  line.add_whole("sequence", row.sequence);
  return line.end();
}

}  // namespace upright
