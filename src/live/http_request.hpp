// The head of an HTTP request, read within fixed limits: what somebody sends never decides how much memory is
// taken.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace upright {

/// Browsers send about 1 KiB, and the cookies of every other program on this host name besides.
inline constexpr std::size_t longest_head_bytes = 8192;
inline constexpr std::size_t longest_line_bytes = 4096;
inline constexpr std::size_t max_header_fields = 64;

/// Status codes that the server answers with.
enum class HttpStatus : int {
  ok = 200,
  bad_request = 400,
  forbidden = 403,
  not_found = 404,
  head_too_large = 431,
  too_many_pages = 503,
};

/// Views into the text that was read.
struct HttpRequest {
  struct Field {
    std::string_view name, value;
  };

  std::string_view method;
  std::string_view path;  ///< without a query
  std::array<Field, max_header_fields> fields;
  std::size_t field_count = 0;

  /// The value of a field, whose name is compared without regard to case; empty where it is missing.
  std::string_view value_of(std::string_view name) const;
  std::size_t count_of(std::string_view name) const;
};

enum class HeadReading {
  incomplete,  ///< no fault so far, the end has not come
  complete,
  too_large,  ///< beyond one of the limits
  malformed,
};

/// Reads what has come of a head. `request` is filled in when it is complete.
HeadReading read_head(std::string_view text, HttpRequest& request);

}  // namespace upright
