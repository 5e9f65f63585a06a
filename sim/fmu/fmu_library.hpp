// The library that every FMU contains (fmi2_functions.cpp), inside the program.
#pragma once

#include <string_view>

namespace upright {

std::string_view fmu_library();

}  // namespace upright
