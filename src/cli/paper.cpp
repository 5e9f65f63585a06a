// `upright paper`: the paper's figures and numbers recomputed, as a document with plots.
#include "studies/paper/paper.hpp"

#include <cstdio>
#include <memory>
#include <string>

#include "commands.hpp"
#include "progress.hpp"
#include "upright/base/error.hpp"

namespace upright::cli {

void add_paper(CommandLine& line) {
  const Command command =
      line.command("paper", "Recompute the paper's figures and tables",
                   "Example:  upright paper --out docs   (scripts/reproduce-paper.sh does this)");
  const auto options = std::make_shared<PaperOptions>();
  const auto out = std::make_shared<std::string>("runs/paper");
  const auto config = std::make_shared<std::string>("config");
  const auto overwrite = std::make_shared<bool>(false);
  command.option("--out", *out, "Folder for paper.md and its plots (default: runs/paper)");
  command.option("--config", *config, "Folder with gains, plants and rigs (default: config)");
  command.option("--threads", options->threads, "Number of threads (default: one per processor)")
      .from_to(1u, 1024u);
  command.flag("--overwrite", *overwrite, "Replace an existing paper.md in the folder");
  command.does([=] {
    const std::filesystem::path file = std::filesystem::path(*out) / "paper.md";
    if (std::filesystem::exists(file) && !*overwrite)
      throw ConfigError(file.string() +
                        " already exists: choose another folder with --out, or replace it with --overwrite");
    options->config = *config;
    Progress progress("paper");
    options->progress = progress.callback();
    write_paper(*out, *options);
    progress.end();
    std::printf("%s\n", file.c_str());
    std::fflush(stdout);
    return ExitCode::done;
  });
}

}  // namespace upright::cli
