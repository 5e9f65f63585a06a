// The registration of every kind of piece: one line each. Their order here is the order of messages.
#pragma once

#include <tuple>

#include "experiment/pieces/closed_loop.hpp"
#include "experiment/pieces/coast.hpp"
#include "experiment/pieces/constant_voltage.hpp"
#include "experiment/pieces/delay_sweep.hpp"
#include "experiment/pieces/free_decay.hpp"
#include "experiment/pieces/multisine.hpp"
#include "experiment/pieces/observe.hpp"
#include "experiment/pieces/ramp.hpp"
#include "experiment/pieces/sign_check.hpp"
#include "experiment/pieces/slow_sine.hpp"
#include "experiment/pieces/square_wave.hpp"

namespace upright {

// clang-format off
using AllPieces =
    std::tuple<pieces::ConstantVoltage,
               pieces::Ramp,
               pieces::Coast,
               pieces::SquareWave,
               pieces::Multisine,
               pieces::SlowSine,
               pieces::FreeDecay,
               pieces::Observe,
               pieces::ClosedLoop,
               pieces::DelaySweep,
               pieces::SignCheck>;
// clang-format on

}  // namespace upright
