/* infrared: drives about and turns away before it touches anything.
   Robot shieldbot-basic, arena room.

   An LED flashes 38,000 times a second for a moment; the receiver beside it reads LOW when something throws that
   light back. */
#include <Servo.h>

const int LEFT_LED = 9, LEFT_RECEIVER = 10, RIGHT_LED = 2, RIGHT_RECEIVER = 3;
Servo left, right;

// Whether there is something before that LED, up to 20 cm or so away.
bool sees(int led, int receiver) {
  tone(led, 38000);
  delay(1);
  bool found = digitalRead(receiver) == LOW;
  noTone(led);
  delay(1);  // the receiver recovers
  return found;
}

// Both wheels at a speed, -200 (full backward) to 200 (full forward), for that time (ms).
void drive(int leftSpeed, int rightSpeed, int time) {
  left.writeMicroseconds(1500 + leftSpeed);
  right.writeMicroseconds(1500 - rightSpeed);
  delay(time);
}

void setup() {
  left.attach(13);
  right.attach(12);
}

void loop() {
  bool seesLeft = sees(LEFT_LED, LEFT_RECEIVER);
  bool seesRight = sees(RIGHT_LED, RIGHT_RECEIVER);
  if (seesLeft && seesRight) drive(-200, 200, 600);  // about
  else if (seesLeft) drive(200, -200, 20);           // to the right
  else if (seesRight) drive(-200, 200, 20);          // to the left
  else drive(200, 200, 20);
}
