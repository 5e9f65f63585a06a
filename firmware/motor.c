#include "motor.h"

#include "board.h"

// Timer 1 counts 800 steps per period. The resulting 20 kHz is inaudible and suits common bridges. The largest width is
// one step less than a period, since a bridge may need this gap to recharge the gate supply of its upper transistors.
#define STEPS 800
#define MAX_STEPS (STEPS - 1)
#define CONNECTED (1 << COM1A1 | 1 << WGM11)
#if defined(__AVR_ATmega328P__)
#define LAMP_PORT PORTB
#define LAMP_DDR DDRB
#define LAMP_BIT 5
#else
#define LAMP_PORT PORTB
#define LAMP_DDR DDRB
#define LAMP_BIT 7
#endif

static bool driven;     // the timer drives the pin
static bool backwards;  // the level of the direction pin

/// The pin is then low. In the normal mode the timer applies a new width at once.
static void disconnect(void) {
  TCCR1A = 0;
  PWM_PORT &= (uint8_t)~(1 << PWM_BIT);
  driven = false;
}

void motor_begin(void) {
  PWM_PORT &= (uint8_t)~(1 << PWM_BIT);
  PWM_DDR |= 1 << PWM_BIT;
  DIRECTION_PORT &= (uint8_t)~(1 << DIRECTION_BIT);
  DIRECTION_DDR |= 1 << DIRECTION_BIT;
  ENABLE_PORT &= (uint8_t)~(1 << ENABLE_BIT);
  ENABLE_DDR |= 1 << ENABLE_BIT;
  LAMP_DDR |= 1 << LAMP_BIT;
  ICR1 = STEPS - 1;
  TCCR1A = 0;
  TCCR1B = 1 << WGM13 | 1 << WGM12 | 1 << CS10;
}

void motor_drive(int16_t millivolts) {
  const bool back = millivolts < 0;
  const uint16_t size = back ? (uint16_t)(0 - (uint16_t)millivolts) : (uint16_t)millivolts;
  const uint16_t steps = size >= SUPPLY_MV ? MAX_STEPS : (uint16_t)((uint32_t)size * STEPS / SUPPLY_MV);
  // With width 0 the timer would still produce a pulse of one cycle.
  if (steps == 0) {
    disconnect();
    return;
  }
  // Prevents the old width in the new direction.
  if (driven && back != backwards) disconnect();
  if (back)
    DIRECTION_PORT |= 1 << DIRECTION_BIT;
  else
    DIRECTION_PORT &= (uint8_t)~(1 << DIRECTION_BIT);
  backwards = back;
  OCR1A = steps - 1;
  if (!driven) TCCR1A = CONNECTED;
  driven = true;
}

void motor_enable(bool on) {
  if (on) {
    ENABLE_PORT |= 1 << ENABLE_BIT;
    LAMP_PORT |= 1 << LAMP_BIT;
  } else {
    ENABLE_PORT &= (uint8_t)~(1 << ENABLE_BIT);
    LAMP_PORT &= (uint8_t)~(1 << LAMP_BIT);
  }
}

void motor_off(void) {
  disconnect();
  motor_enable(false);
}
