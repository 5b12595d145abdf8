/* dance: steps and turns by time alone, each to a note.
   Robot shieldbot-basic, arena empty.

   The right servo is mounted the other way round: for it forward is a pulse shorter than 1.5 ms. */
#include <Servo.h>

const int BUZZER = 4;
Servo left, right;

// Both wheels at a speed, -200 (full backward) to 200 (full forward), for that time (ms), to a note (Hz).
void step(int leftSpeed, int rightSpeed, int time, int note) {
  left.writeMicroseconds(1500 + leftSpeed);
  right.writeMicroseconds(1500 - rightSpeed);
  tone(BUZZER, note, time / 2);
  delay(time);
}

void setup() {
  left.attach(13);
  right.attach(12);
  for (int i = 0; i < 2; i++) {
    step(200, 200, 1000, 523);   // forward: c
    step(-200, 200, 1000, 659);  // half a turn to the left, on the spot: e
    step(200, 200, 1000, 523);   // back to where it began
    step(200, -200, 1000, 784);  // half a turn to the right: g
  }
  left.detach();  // without pulses the servos rest
  right.detach();
}

void loop() {}
