// The registration of every backend. Their order here is the order of messages and that of the enumerators of
// Backend; a backend that no other code has to know by name needs none.
#pragma once

#include <array>

#include "backend_kind.hpp"

namespace upright {

using DescribeBackend = BackendKind();

// clang-format off
DescribeBackend simulated_backend,
                modbus_tcp_backend,
                modbus_rtu_backend,
                gpio_backend,
                comedi_backend,
                quanser_backend;

inline constexpr std::array all_backends = {simulated_backend,
                                            modbus_tcp_backend,
                                            modbus_rtu_backend,
                                            gpio_backend,
                                            comedi_backend,
                                            quanser_backend};
// clang-format on

}  // namespace upright
