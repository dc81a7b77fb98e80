#include <QCoreApplication>
int main() { return 0; }
