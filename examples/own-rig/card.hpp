// What the library of a card typically offers. In this example the card is simulated, with a pendulum behind
// it, so that the example runs on any computer: card.cpp is the part that your card's library replaces.
#pragma once

#include <cstdint>

struct Card;

/// Null when there is no such card.
Card* card_open(const char* plant_file);
void card_close(Card* card);
/// Encoder counts of channel 0 (cart) and 1 (pendulum). False: the card did not answer.
bool card_read_encoders(Card* card, double time_s, std::int64_t counts[2]);
/// False: the card did not take the voltage.
bool card_write_volts(Card* card, double time_s, double volts);
