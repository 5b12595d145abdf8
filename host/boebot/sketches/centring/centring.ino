/* centring: holds both servos at the pulse of no speed, 1.5 ms.
   Robot shieldbot-basic, arena empty.

   A wheel that turns all the same has a servo that is not centred: turn the small screw in the servo until it stands.
   Without a screw, find its pulse here: type l or L (left wheel), r or R (right wheel) into the monitor, a small letter
   for 1 us less, a capital for 1 us more. A servo stands still over some 20 us; take the middle. */
#include <Servo.h>

Servo left, right;
int leftPulse = 1500, rightPulse = 1500;  // us

void setup() {
  Serial.begin(9600);
  left.attach(13);
  right.attach(12);
}

void loop() {
  left.writeMicroseconds(leftPulse);
  right.writeMicroseconds(rightPulse);
  Serial.print(leftPulse);
  Serial.print(" us, ");
  Serial.print(rightPulse);
  Serial.println(" us");
  while (!Serial.available()) {}
  switch (Serial.read()) {
    case 'l': leftPulse--; break;
    case 'L': leftPulse++; break;
    case 'r': rightPulse--; break;
    case 'R': rightPulse++; break;
  }
}
