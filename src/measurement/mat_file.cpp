#include "mat_file.hpp"

#include <hdf5.h>
#include <matio.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string_view>

#include "base/input_file.hpp"
#include "upright/base/error.hpp"

namespace upright {

namespace {

namespace fs = std::filesystem;

/// Of one variable, in memory: far above any record, far below what exhausts a machine.
constexpr std::size_t max_bytes = std::size_t{1} << 30;
/// Of a matrix or a structure array, in the list of vectors.
constexpr std::size_t max_listed = 64;
constexpr int deepest_level = 16;

struct CloseMat {
  void operator()(mat_t* mat) const { Mat_Close(mat); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

std::size_t element_count(const matvar_t& v) {
  std::size_t count = 1;
  for (int i = 0; i < v.rank; ++i)
    if (__builtin_mul_overflow(count, v.dims[i], &count)) return max_bytes;
  return v.rank == 0 ? 0 : count;
}

bool is_numeric(const matvar_t& v) {
  return v.class_type >= MAT_C_DOUBLE && v.class_type <= MAT_C_UINT64 && v.isComplex == 0;
}

/// A vector, or a matrix as columns: dimensions of length 1 do not count.
struct Shape {
  std::size_t length = 0, columns = 1;
  bool by_rows = false;  ///< the vectors of a wide matrix are its rows
};

std::optional<Shape> shape_of(const matvar_t& v) {
  std::vector<std::size_t> long_sides;
  for (int i = 0; i < v.rank; ++i)
    if (v.dims[i] != 1) long_sides.push_back(v.dims[i]);
  if (long_sides.size() > 2) return std::nullopt;
  if (long_sides.empty()) return Shape{1};
  if (long_sides.size() == 1) return Shape{long_sides[0]};
  return long_sides[0] >= long_sides[1] ? Shape{long_sides[0], long_sides[1], false}
                                        : Shape{long_sides[1], long_sides[0], true};
}

double element(const matvar_t& v, std::size_t i) {
  switch (v.class_type) {
    case MAT_C_DOUBLE:
      return static_cast<const double*>(v.data)[i];
    case MAT_C_SINGLE:
      return static_cast<double>(static_cast<const float*>(v.data)[i]);
    case MAT_C_INT8:
      return static_cast<const std::int8_t*>(v.data)[i];
    case MAT_C_UINT8:
      return static_cast<const std::uint8_t*>(v.data)[i];
    case MAT_C_INT16:
      return static_cast<const std::int16_t*>(v.data)[i];
    case MAT_C_UINT16:
      return static_cast<const std::uint16_t*>(v.data)[i];
    case MAT_C_INT32:
      return static_cast<const std::int32_t*>(v.data)[i];
    case MAT_C_UINT32:
      return static_cast<const std::uint32_t*>(v.data)[i];
    case MAT_C_INT64:
      return static_cast<double>(static_cast<const std::int64_t*>(v.data)[i]);
    default:
      return static_cast<double>(static_cast<const std::uint64_t*>(v.data)[i]);
  }
}

std::vector<double> vector_of(const matvar_t& v, const Shape& shape, std::size_t column) {
  std::vector<double> values(shape.length);
  for (std::size_t k = 0; k < shape.length; ++k)
    values[k] = element(v, shape.by_rows ? k * shape.columns + column : column * shape.length + k);
  return values;
}

/// One step of a path: `.field`, `(number)` or `{number}` from 1, or `(:,column)` and `(row,:)`.
struct PathStep {
  enum class Kind { field, element, column, row } kind;
  std::string field;
  std::size_t number = 0;  ///< from 0
};

/// The inside of `(...)`. Empty where it is none of the known forms.
std::optional<PathStep> index_step(std::string_view inside) {
  PathStep::Kind kind = PathStep::Kind::element;
  if (inside.starts_with(":,")) {
    kind = PathStep::Kind::column;
    inside.remove_prefix(2);
  } else if (inside.ends_with(",:")) {
    kind = PathStep::Kind::row;
    inside.remove_suffix(2);
  }
  std::size_t number = 0;
  const auto read = std::from_chars(inside.data(), inside.data() + inside.size(), number);
  if (read.ec != std::errc{} || read.ptr != inside.data() + inside.size() || number == 0) return std::nullopt;
  return PathStep{kind, "", number - 1};
}

/// The name of the variable and the steps into it. Empty for what is no path.
struct MatPath {
  std::string variable;
  std::vector<PathStep> steps;
};

std::optional<MatPath> path_of(std::string text) {
  std::erase(text, ' ');
  const std::size_t name = text.find_first_of(".({");
  MatPath path{text.substr(0, name), {}};
  std::string_view rest = name == std::string::npos ? "" : std::string_view(text).substr(name);
  while (!rest.empty()) {
    if (rest.front() == '.') {
      const std::size_t end = std::min(rest.find_first_of(".({", 1), rest.size());
      path.steps.push_back({PathStep::Kind::field, std::string(rest.substr(1, end - 1))});
      rest.remove_prefix(end);
      continue;
    }
    const std::size_t end = rest.find(rest.front() == '(' ? ')' : '}');
    if (end == std::string_view::npos) return std::nullopt;
    const auto step = index_step(rest.substr(1, end - 1));
    if (!step) return std::nullopt;
    path.steps.push_back(*step);
    rest.remove_prefix(end + 1);
  }
  if (path.variable.empty()) return std::nullopt;
  return path;
}

matvar_t* field_of(matvar_t& v, const std::string& field, std::size_t index) {
  if (v.class_type != MAT_C_STRUCT || index >= element_count(v)) return nullptr;
  return Mat_VarGetStructFieldByName(&v, field.c_str(), index);
}

matvar_t* cell_of(matvar_t& v, std::size_t index) {
  if (v.class_type != MAT_C_CELL || index >= element_count(v)) return nullptr;
  return Mat_VarGetCell(&v, static_cast<int>(index));
}

class Lister {
 public:
  explicit Lister(std::vector<MatVector>& found) : found_(found) {}

  void add(matvar_t& v, const std::string& path, int level = 0) {
    if (level > deepest_level) return;
    if (v.class_type == MAT_C_STRUCT) return add_fields(v, path, level);
    if (v.class_type == MAT_C_CELL) {
      for (std::size_t i = 0; i < std::min(element_count(v), max_listed); ++i)
        if (matvar_t* cell = cell_of(v, i)) add(*cell, path + "{" + std::to_string(i + 1) + "}", level + 1);
      return;
    }
    const auto shape = shape_of(v);
    if (!is_numeric(v) || v.data == nullptr || !shape || shape->length < 2) return;
    if (shape->columns == 1) {
      found_.push_back({path, shape->length});
      return;
    }
    for (std::size_t c = 0; c < std::min(shape->columns, max_listed); ++c) {
      const std::string number = std::to_string(c + 1);
      found_.push_back(
          {path + (shape->by_rows ? "(" + number + ",:)" : "(:," + number + ")"), shape->length});
    }
  }

 private:
  void add_fields(matvar_t& v, const std::string& path, int level) {
    const std::size_t count = element_count(v);
    char* const* names = Mat_VarGetStructFieldnames(&v);
    const unsigned fields = Mat_VarGetNumberOfFields(&v);
    for (std::size_t i = 0; i < std::min(count, max_listed); ++i)
      for (unsigned f = 0; names != nullptr && f < fields; ++f)
        if (matvar_t* field = field_of(v, names[f], i))
          add(*field, path + (count > 1 ? "(" + std::to_string(i + 1) + ")" : "") + "." + names[f],
              level + 1);
  }

  std::vector<MatVector>& found_;
};

}  // namespace

class MatFile::Implementation {
 public:
  explicit Implementation(const fs::path& file) : file_(file) {
    const InputFile regular(file);                // refuses what is no file
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // HDF5 would print its own errors
    mat_.reset(Mat_Open(file.c_str(), MAT_ACC_RDONLY));
    if (!mat_)
      throw ConfigError(file.string() +
                        ":1: this is no MATLAB file that can be read: save it again in MATLAB, or export the "
                        "signals as text");
  }

  std::vector<std::string> names() const {
    std::size_t count = 0;
    char** list = Mat_GetDir(mat_.get(), &count);
    std::vector<std::string> names;
    for (std::size_t i = 0; list != nullptr && i < count; ++i)
      if (list[i] != nullptr) names.emplace_back(list[i]);
    return names;
  }

  /// Null where there is none of this name.
  Variable read(const std::string& name) const {
    Mat_Rewind(mat_.get());
    Variable info(Mat_VarReadInfo(mat_.get(), name.c_str()));
    if (!info) return nullptr;
    const std::size_t size = element_count(*info);
    constexpr std::size_t longest_number = 8;
    if (size > max_bytes / longest_number)
      throw ConfigError(file_.string() + ": " + name + " has " + std::to_string(size) +
                        " elements, more than a record can have: save the part that matters");
    Mat_Rewind(mat_.get());
    return Variable(Mat_VarRead(mat_.get(), name.c_str()));
  }

  std::vector<double> values(const std::string& text) const {
    const auto path = path_of(text);
    if (!path) return {};
    const Variable variable = read(path->variable);
    matvar_t* at = variable.get();
    std::size_t index = 0;
    for (std::size_t s = 0; at != nullptr && s < path->steps.size(); ++s) {
      const PathStep& step = path->steps[s];
      const bool last = s + 1 == path->steps.size();
      if (step.kind == PathStep::Kind::field) {
        at = field_of(*at, step.field, index);
        index = 0;
      } else if (step.kind != PathStep::Kind::element) {
        return last ? matrix_part(*at, step, text) : std::vector<double>{};
      } else if (at->class_type == MAT_C_CELL) {
        at = cell_of(*at, step.number);
      } else if (at->class_type == MAT_C_STRUCT && !last) {
        index = step.number;
      } else {
        return {};
      }
    }
    if (at == nullptr) return {};
    const Shape shape = numeric_shape(*at, text);
    if (shape.columns != 1)
      throw ConfigError(file_.string() + ": " + text + " is a matrix with " + std::to_string(shape.columns) +
                        (shape.by_rows ? " rows: name one, as " + text + "(1,:)"
                                       : " columns: name one, as " + text + "(:,1)"));
    return vector_of(*at, shape, 0);
  }

 private:
  Shape numeric_shape(const matvar_t& v, const std::string& text) const {
    const auto refuse = [&](const std::string& what, const std::string& remedy) {
      throw ConfigError(file_.string() + ": " + text + " is " + what + ": " + remedy);
    };
    if (v.class_type == MAT_C_OBJECT || v.class_type == MAT_C_OPAQUE)
      refuse("a MATLAB object, such as a timeseries, which only MATLAB can read",
             "save its numbers, as x = struct('time', ts.Time, 'values', ts.Data), or log in the format "
             "\"Structure With Time\"");
    const auto shape = shape_of(v);
    if (!is_numeric(v) || v.data == nullptr || !shape)
      refuse("no real vector", "name a vector of numbers, or a column of a matrix as x(:,1)");
    return *shape;
  }

  std::vector<double> matrix_part(const matvar_t& v, const PathStep& step, const std::string& text) const {
    const Shape shape = numeric_shape(v, text);
    if (v.rank != 2) return {};
    const bool row = step.kind == PathStep::Kind::row;
    const std::size_t rows = v.dims[0], columns = v.dims[1];
    if (step.number >= (row ? rows : columns)) return {};
    std::vector<double> values(row ? columns : rows);
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = element(v, row ? k * rows + step.number : step.number * rows + k);
    return shape.length == 0 ? std::vector<double>{} : values;
  }

  fs::path file_;
  std::unique_ptr<mat_t, CloseMat> mat_;
};

MatFile::MatFile(const fs::path& file) : implementation_(std::make_unique<Implementation>(file)) {}
MatFile::~MatFile() = default;

std::vector<MatVector> MatFile::vectors() const {
  std::vector<MatVector> found;
  for (const std::string& name : implementation_->names())
    if (const Variable variable = implementation_->read(name)) Lister(found).add(*variable, name);
  return found;
}

std::vector<double> MatFile::values(const std::string& path) const {
  return implementation_->values(path);
}

bool is_mat_file(const fs::path& file) {
  if (file.extension() == ".mat") return true;
  InputFile in(file);
  std::array<char, 10> begin{};
  in.read(begin.data(), begin.size());
  const std::string_view text(begin.data(), static_cast<std::size_t>(in.gcount()));
  return text == "MATLAB 5.0" || text == "MATLAB 7.3";
}

void write_mat_file(const fs::path& file,
                    const std::vector<std::pair<std::string, std::vector<double>>>& vectors) {
  const auto refuse = [&] {
    throw ConfigError("cannot write " + file.string() + ": check the folder and its free space");
  };
  const std::unique_ptr<mat_t, CloseMat> mat(Mat_CreateVer(file.c_str(), nullptr, MAT_FT_MAT5));
  if (!mat) refuse();
  for (const auto& [name, values] : vectors) {
    std::array<std::size_t, 2> size = {values.size(), 1};
    const Variable variable(Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size.data(),
                                          const_cast<double*>(values.data()), MAT_F_DONT_COPY_DATA));
    if (!variable || Mat_VarWrite(mat.get(), variable.get(), MAT_COMPRESSION_ZLIB) != 0) refuse();
  }
}

}  // namespace upright
