// Pin assignments of each board, and the settings that a builder may change. The assembler also includes this file.
#pragma once

#include <avr/io.h>

// The Makefile sets SUPPLY_MV, BAUD and UNIT from variables of the same names.
#ifndef SUPPLY_MV
#define SUPPLY_MV 12000  // supply of the bridge; full duty gives this voltage
#endif
#ifndef BAUD
#define BAUD 500000
#endif
#ifndef UNIT
#define UNIT 1  // the device's Modbus address
#endif

// The four encoder lines are bits 0 to 3 of one port, so that one instruction reads all of them at the same moment. On
// both boards they are A0 to A3: cart A, cart B, pendulum A, pendulum B.
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
#error "this processor is not supported: build for atmega328p or atmega2560"
#endif

#if F_CPU != 16000000
#error "F_CPU must be 16000000, the clock of the boards"
#endif
#if F_CPU % (8L * BAUD) != 0
#error "BAUD does not divide 16 MHz exactly: use 500000, 1000000 or 2000000, not 115200 or 921600"
#endif

// One interrupt samples the encoders at a fixed rate. No edge is missed if the edges of one encoder are further apart
// than the sample period and its jitter of a few cycles. The load does not depend on the encoders, so noise on their
// lines cannot block the processor.
#define CYCLES_PER_SAMPLE 128  // 125 kHz; the interrupt takes 47 to 80 of them

// The sampler keeps its state in registers that are read in one cycle.
#define LAST_LINES GPIOR0    // the last sample of the encoder lines, in the upper four bits
#define CART_LOW GPIOR1      // the lower eight bits of the counts
#define PENDULUM_LOW GPIOR2
