// Digital lines and line encoders as rigs, over the kernel's GPIO character device.
#pragma once

#include <memory>

#include "upright/hal/rig.hpp"
#include "upright/hal/rig_file.hpp"

namespace upright {

/// `rig` behind the lines of `file`'s section `gpio`; `rig` itself where it names none of these. Emergency
/// stop and limit switches are read after each reading and are its fault while active: they come before
/// anything `rig` has to say. The amplifier is enabled once a voltage was written after open(), and disabled
/// by stop(); the heartbeat toggles with each voltage that `rig` took, and rests after stop().
/// A line that cannot be read or set is RigFault::line_failed.
std::unique_ptr<Rig> with_gpio_lines(std::unique_ptr<Rig> rig, const RigFile& file);

/// The encoders of `file`'s section `gpio` as a rig that has no output: its write() is refused. They count
/// from zero when it is opened first, and go on when it is opened again. An encoder that the section does not
/// name stays at zero counts. Once edges were lost or came too fast, every reading is that fault, and opening
/// it again is refused. open() throws ConfigError where the kernel's queue could not hold the edges of
/// `period_s`.
std::unique_ptr<Rig> make_gpio_encoders(const RigFile& file, double period_s);

}  // namespace upright
