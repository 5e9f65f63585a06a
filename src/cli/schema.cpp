// `upright schema`: the JSON Schema of a kind of file, for editors.
#include <fstream>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "schema/file_schemas.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

namespace {

std::string schema_text(const std::string& kind) {
  for (const FileSchema& schema : file_schemas())
    if (schema.kind == kind) return schema.text();
  return "";
}

void write_text(const std::string& text, const std::string& file) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw ConfigError("cannot write " + file + ": check that its folder exists and has free space");
}

}  // namespace

void add_schema(CommandLine& line) {
  const Command command = line.command("schema", "Print the JSON Schema of a kind of file",
                                       "Examples:\n"
                                       "  upright schema rig\n"
                                       "  upright schema gains --out gains.json\n"
                                       "Editors complete and check a YAML file whose first line is\n"
                                       "  # yaml-language-server: $schema=FILE");
  const auto kind = std::make_shared<std::string>(), out = std::make_shared<std::string>();
  std::vector<std::string> kinds;
  for (const FileSchema& schema : file_schemas()) kinds.emplace_back(schema.kind);
  command.option("kind", *kind, "Kind of file").required().one_of(kinds);
  command.option("--out", *out, "File to write (default: standard output)");
  command.does([kind, out] {
    const std::string text = schema_text(*kind);
    if (out->empty())
      std::cout << text;
    else
      write_text(text, *out);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
