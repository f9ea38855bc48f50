// One vehicle's talk with the server: the client of the physics thread, and the table of rest loads, asked for beside it.

#pragma once

#include "CoreMinimal.h"
#include "Async/Future.h"
#include "core/connection.h"
#include "core/fleet.h"

#include <memory>
#include <string>

/** A vehicle at an address, with the files of the project's settings. */
wade::Connection WadeConnection(const FString& Address, const FString& Vehicle);

class FWadeLink
{
public:
	/** Opens the client; does not wait for the server. On failure the log says why and `IsOpen` is false. */
	FWadeLink(const wade::Connection& Connection, bool bPoll);
	/** Closes in the background: closing may take as long as opening a connection does. */
	~FWadeLink();

	bool IsOpen() const { return Client != nullptr; }

	/** May be called from any thread. */
	wade_status Evaluate(const wade_state& State, uint64 BudgetNs, wade_forces& Forces) const;

	/** The same for several vehicles of this name. */
	wade_status EvaluateBatch(const wade_state* States, size_t Count, uint64 BudgetNs, wade_forces* Forces) const;

	/** Whether a batch may replace questions asked alone: over gRPC it has no sessions. */
	bool HasBatches() const { return bBatches; }

	/** Vehicles of one group are one name on one server. */
	const std::string& Group() const { return GroupName; }

	/** Why there is no connection. Game thread. */
	FString Reason();

	/** Whether there is another reason than the last that was read, looked at once a second. `Time`: since the call before [s]. Game
	 *  thread. */
	bool HasNewReason(double Time, FString& NewReason);

	/** Asks, in the background, for the rest loads of the bundle that answers now, unless that is known or under way. Game thread. */
	void RefreshTable(uint32 BundleVersion, const wade::Hull& Hull);

	/** The rest loads, or null. Game thread. */
	std::shared_ptr<const wade::RestTable> Table();

private:
	wade::Connection Connection;
	wade::ConnectionReason LastReason;
	std::string GroupName;
	bool bBatches = false;
	wade_client* Client = nullptr;
	std::shared_ptr<const wade::RestTable> Known;
	TFuture<std::shared_ptr<const wade::RestTable>> Asked;
};
