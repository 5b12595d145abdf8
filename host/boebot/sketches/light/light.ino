/* light: drives to the lamp and stops there.
   Robot shieldbot-basic, arena station.

   A light sensor empties a capacitor, the faster the brighter it is. The pin charges it, and then the program takes
   the time until the pin reads LOW. */
#include <Servo.h>

const int LEFT_LIGHT = 8, RIGHT_LIGHT = 6;
const long BRIGHT = 14;  // us: so soon the capacitor is empty 30 cm from the lamp
Servo left, right;

// Time (us) in which the light empties the capacitor at that pin.
long decayTime(int pin) {
  pinMode(pin, OUTPUT);
  digitalWrite(pin, HIGH);
  delayMicroseconds(100);
  pinMode(pin, INPUT);
  digitalWrite(pin, LOW);  // no pull-up
  unsigned long begin = micros();
  while (digitalRead(pin) == HIGH && micros() - begin < 50000) {}
  return micros() - begin;
}

void setup() {
  Serial.begin(9600);
  left.attach(13);
  right.attach(12);
}

void loop() {
  long l = decayTime(LEFT_LIGHT), r = decayTime(RIGHT_LIGHT);
  Serial.print(l);
  Serial.print(" us, ");
  Serial.print(r);
  Serial.println(" us");
  long turn = constrain(800 * (l - r) / (l + r), -200, 200);  // more than 0: it is brighter on the right
  left.writeMicroseconds(1500 + constrain(100 + turn, -200, 200));
  right.writeMicroseconds(1500 - constrain(100 - turn, -200, 200));
  if (l + r < 2 * BRIGHT) {
    left.detach();  // without pulses the servos rest
    right.detach();
  }
  delay(50);
}
