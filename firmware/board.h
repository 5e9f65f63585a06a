// Which pin does what, per board, and the numbers that a builder may want to change. Also read by the assembler.
#pragma once

#include <avr/io.h>

// Of the make variables (Makefile): SUPPLY_MV, BAUD, UNIT.
#ifndef SUPPLY_MV
#define SUPPLY_MV 12000  // what the bridge gets: full duty is this voltage
#endif
#ifndef BAUD
#define BAUD 500000
#endif
#ifndef UNIT
#define UNIT 1  // the device's Modbus address
#endif

// The four encoder lines are bits 0 to 3 of one port, so that one instruction takes them all at the same moment, and bear
// the same names, A0 to A3, on both boards: cart A, cart B, pendulum A, pendulum B.
#if defined(__AVR_ATmega328P__)
#define ENCODER_PIN PINC
#define ENCODER_PORT PORTC
#define STOP_PIN PIND
#define STOP_PORT PORTD
#define EMERGENCY_STOP_BIT 4  // D4
#define PLUS_SWITCH_BIT 5     // D5
#define MINUS_SWITCH_BIT 6    // D6
#define ENABLE_PORT PORTD
#define ENABLE_DDR DDRD
#define ENABLE_BIT 7  // D7
#define DIRECTION_PORT PORTB
#define DIRECTION_DDR DDRB
#define DIRECTION_BIT 0  // D8
#define PWM_PORT PORTB
#define PWM_DDR DDRB
#define PWM_BIT 1  // D9, output A of timer 1
#elif defined(__AVR_ATmega2560__)
#define ENCODER_PIN PINF
#define ENCODER_PORT PORTF
#define STOP_PIN PINA
#define STOP_PORT PORTA
#define EMERGENCY_STOP_BIT 0  // D22
#define PLUS_SWITCH_BIT 1     // D23
#define MINUS_SWITCH_BIT 2    // D24
#define ENABLE_PORT PORTB
#define ENABLE_DDR DDRB
#define ENABLE_BIT 4  // D10
#define DIRECTION_PORT PORTB
#define DIRECTION_DDR DDRB
#define DIRECTION_BIT 6  // D12
#define PWM_PORT PORTB
#define PWM_DDR DDRB
#define PWM_BIT 5  // D11, output A of timer 1
#else
#error "build for atmega328p or atmega2560"
#endif

#if F_CPU != 16000000
#error "the boards run at 16 MHz"
#endif
#if F_CPU % (8L * BAUD) != 0
#error "16 MHz gives 250000, 500000, 1000000 or 2000000 baud exactly; the usual 115200 or 921600 it does not"
#endif

// The encoders are sampled by one interrupt at a fixed rate: an edge is never missed as long as those of one encoder are
// further apart than a sample and the few cycles by which it may be late. The load is the same whatever the encoders do,
// so that no noise on their lines can keep the processor from anything else.
#define CYCLES_PER_SAMPLE 128  // 125 kHz; the interrupt takes 47 to 80 of them

// Where the sampler keeps what it needs at once: registers that are read in one cycle.
#define LAST_LINES GPIOR0    // the encoders' lines in the upper four bits, as they were sampled last
#define CART_LOW GPIOR1      // the lower eight bits of the counts
#define PENDULUM_LOW GPIOR2
