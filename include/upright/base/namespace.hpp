// The pages of the reference that no header has. Nothing includes this file.
#pragma once

/// Everything of upright. Quantities are in SI units, with the unit at the end of the name; an angle of the
/// pendulum is 0 upright and positive where it leans toward +x. Functions that read files or set something up
/// throw upright::Error, with the cause and the remedy as one sentence. What the control loop calls is
/// noexcept, and neither allocates nor locks.
namespace upright {

/// One struct for each effect of a plant; effect.hpp describes their members.
namespace effects {}

/// Elementary functions with the same bits on every processor.
namespace elementary {}

/// Bits of LogRecord::flags.
namespace row_flag {}

}  // namespace upright
