#include "fmu_library.hpp"

// The build names the file.
asm(".pushsection .rodata\n"
    ".hidden upright_fmu_begin\n.global upright_fmu_begin\nupright_fmu_begin:\n"
    ".incbin \"" UPRIGHT_FMU_LIBRARY
    "\"\n"
    ".hidden upright_fmu_end\n.global upright_fmu_end\nupright_fmu_end:\n"
    ".popsection\n");
extern "C" const char upright_fmu_begin[], upright_fmu_end[];

namespace upright {

std::string_view fmu_library() {
  return {upright_fmu_begin, static_cast<std::size_t>(upright_fmu_end - upright_fmu_begin)};
}

}  // namespace upright
