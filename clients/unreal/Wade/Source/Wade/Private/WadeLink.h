// One vehicle's talk with the server: the client of the physics thread, and the table of rest loads, asked for beside it.

#pragma once

#include "CoreMinimal.h"
#include "Async/Future.h"
#include "core/rest_table.h"

#include <memory>

class FWadeLink
{
public:
	/** Opens the client; does not wait for the server. On failure the log says why and `IsOpen` is false. */
	FWadeLink(const FString& Address, const FString& Vehicle, bool bPoll);
	/** Closes in the background: closing may take as long as opening a connection does. */
	~FWadeLink();

	bool IsOpen() const { return Client != nullptr; }

	/** May be called from any thread. */
	wade_status Evaluate(const wade_state& State, uint64 BudgetNs, wade_forces& Forces) const;

	/** Why there is no connection. */
	FString Reason() const;

	/** Asks, in the background, for the rest loads of the bundle that answers now, unless that is known or under way. Game thread. */
	void RefreshTable(uint32 BundleVersion, const wade::Hull& Hull);

	/** The rest loads, or null. Game thread. */
	std::shared_ptr<const wade::RestTable> Table();

private:
	FString Address;
	FString Vehicle;
	wade_client* Client = nullptr;
	std::shared_ptr<const wade::RestTable> Known;
	TFuture<std::shared_ptr<const wade::RestTable>> Asked;
};
