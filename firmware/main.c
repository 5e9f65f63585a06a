// Main program of a board that acts as the Modbus RTU device of config/rigs/board.yaml: two encoders, a motor bridge,
// stop inputs, and a watchdog that switches the voltage off. See docs/how-to/build-a-board.md.
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/wdt.h>

#include "clock.h"
#include "encoders.h"
#include "modbus.h"
#include "motor.h"
#include "registers.h"
#include "sampling.h"

static uint16_t EEMEM boots_kept;

/// After a reset by the processor's watchdog, the watchdog still runs with its shortest time.
void stop_watchdog(void) __attribute__((naked, used, section(".init3")));
void stop_watchdog(void) {
  MCUSR = 0;
  wdt_disable();
}

static uint16_t count_boot(void) {
  const uint16_t boots = eeprom_read_word(&boots_kept) + 1;
  eeprom_update_word(&boots_kept, boots);
  return boots;
}

int main(void) {
  motor_begin();
  registers_begin(count_boot());
  clock_begin();
  modbus_begin();
  encoders_begin();
  sei();
  // One pass of the loop takes less than a millisecond. If a pass does not complete, the watchdog resets the processor.
  wdt_enable(WDTO_15MS);
  uint8_t before = clock_now(), steps_of_tick = 0;
  for (;;) {
    wdt_reset();
    const uint8_t now = clock_now();
    const uint8_t elapsed_steps = (uint8_t)(now - before);
    before = now;
    const uint16_t steps = (uint16_t)(steps_of_tick + elapsed_steps);
    const uint8_t elapsed_ticks = (uint8_t)(steps / STEPS_PER_TICK);
    steps_of_tick = steps % STEPS_PER_TICK;
    if (sampling_is_due(elapsed_steps)) modbus_sample();
    registers_watch(elapsed_ticks);
    modbus_serve(elapsed_ticks);
  }
}
