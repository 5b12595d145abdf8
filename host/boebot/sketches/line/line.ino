/* line: follows a line of black tape.
   Robot shieldbot-line, arena track.

   A line sensor empties a capacitor by the light that the floor throws back: over white within 1 ms, over black not. */
#include <Servo.h>

const int LEFT_SENSOR = 7, MIDDLE_SENSOR = 6, RIGHT_SENSOR = 5;
Servo left, right;

// Whether the floor under the sensor at that pin is black.
bool isBlack(int pin) {
  pinMode(pin, OUTPUT);
  digitalWrite(pin, HIGH);
  delayMicroseconds(100);
  pinMode(pin, INPUT);
  digitalWrite(pin, LOW);  // no pull-up
  delay(1);
  return digitalRead(pin) == HIGH;
}

// Both wheels at a speed, -200 (full backward) to 200 (full forward).
void drive(int leftSpeed, int rightSpeed) {
  left.writeMicroseconds(1500 + leftSpeed);
  right.writeMicroseconds(1500 - rightSpeed);
}

void setup() {
  left.attach(13);
  right.attach(12);
}

void loop() {
  bool l = isBlack(LEFT_SENSOR), m = isBlack(MIDDLE_SENSOR), r = isBlack(RIGHT_SENSOR);
  if (l && !r) drive(-20, 80);
  else if (r && !l) drive(80, -20);
  else if (m) drive(80, 80);
  // None of them sees the line: it goes on as before.
}
