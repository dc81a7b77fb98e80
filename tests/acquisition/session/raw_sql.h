#pragma once

#include <QSqlDatabase>
#include <QSqlError>
#include <QSqlQuery>
#include <QStringList>
#include <QTest>

namespace fieldtrue::testing {

/// Writes into a session behind the program's back, in one transaction.
inline void runSql(const QString& path, const QStringList& statements) {
  const QString connection = QStringLiteral("raw");
  {
    QSqlDatabase database = QSqlDatabase::addDatabase("QSQLITE", connection);
    database.setDatabaseName(path);
    QVERIFY(database.open());
    QVERIFY(database.transaction());
    for (const QString& sql : statements) {
      QSqlQuery query(database);
      QVERIFY2(query.exec(sql), qPrintable(query.lastError().text()));
    }
    QVERIFY(database.commit());
    database.close();
  }
  QSqlDatabase::removeDatabase(connection);
}

}  // namespace fieldtrue::testing
